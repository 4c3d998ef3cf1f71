#!/usr/bin/env python3
"""Writes the tables of the verification pages from the runs in results/verification, between the markers
`<!-- measured -->` and `<!-- end -->`; see reproduce.sh. Only the standard library."""

import base64
import csv
import json
import math
import re
import struct
import sys
import zlib
from pathlib import Path

HERE = Path(__file__).parent
RUNS = HERE.parent.parent / "results" / "verification"


class Run:
    """A directory of results."""

    def __init__(self, scene, case):
        self.path = RUNS / scene / case
        self.report = json.loads((self.path / "report.json").read_text())
        if self.report["status"] not in ("completed", "failed"):
            sys.exit(f"{self.path}: {self.report['status']}")

    def table(self, name):
        with open(self.path / f"{name}.csv", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        return {key: [float(row[key]) for row in rows] for key in rows[0]}

    def probe(self, column):
        table = self.table("probes")
        return table["t"], table[column]

    def at(self, probe, quantity="displacement"):
        return self.report["probes"][probe][quantity]

    def error(self, field="displacement"):
        return self.report["errors"][field]["l2"]

    @property
    def energy(self):
        return self.report["energy"]

    @property
    def drift(self):
        return self.energy["max_relative_drift"]

    @property
    def particles(self):
        return self.report["particles"]

    @property
    def steps(self):
        return self.report["steps"]["accepted"]

    def excess(self):
        """The mean step over the explicit limit."""
        return self.report["time_reached"] / self.steps / self.report["explicit_step_limit"]


def number(value, digits=3):
    """`1.23e-4`, without the zeros of an exponent."""
    if value == 0:
        return "0"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return f"{mantissa}e{int(exponent)}"


def orders(spacings, errors):
    """Observed orders between one row and the next."""
    found = [math.log(b / a) / math.log(d / c) for a, b, c, d in zip(errors, errors[1:], spacings, spacings[1:])]
    return [""] + [f"{order:.2f}" for order in found]


def percent(value, reference):
    return f"{100 * (value / reference - 1):+.2f} %"


def extremum(times, values, sign):
    """First extremum, a minimum for sign = 1, refined by a parabola: time and value."""
    values = [sign * value for value in values]
    for i in range(1, len(values) - 1):
        if values[i] < values[i - 1] and values[i] <= values[i + 1]:
            slope = 0.5 * (values[i + 1] - values[i - 1])
            bend = values[i + 1] - 2 * values[i] + values[i - 1]
            shift = -slope / bend
            step = times[i + 1] - times[i]
            return times[i] + shift * step, sign * (values[i] + slope * shift + 0.5 * bend * shift * shift)
    sys.exit("no extremum")


def crossings(times, values, level=0.0):
    """Times at which the series passes a level upwards."""
    pairs = zip(times, times[1:], values, values[1:])
    return [a + (level - u) * (b - a) / (v - u) for a, b, u, v in pairs if u < level <= v]


def period(times, values, level=0.0):
    """Mean time between passages of a level upwards, the start included if it is one."""
    found = crossings(times, values, level)
    if values[0] == level and values[1] > level:
        found.insert(0, times[0])
    return (found[-1] - found[0]) / (len(found) - 1)


def ending(run):
    """Whether and when a run failed."""
    return "completed" if run.report["status"] == "completed" else f"fails at t = {run.report['time_reached']:.4g} s"


def value_at(times, values, time):
    for a, b, u, v in zip(times, times[1:], values, values[1:]):
        if a <= time <= b:
            return u + (v - u) * (time - a) / (b - a)
    sys.exit(f"{time} s is outside of the run")


def point_data(path, name):
    """Values of an array of a frame, and the number of components."""
    content = path.read_bytes()
    head, data = content.split(b"<AppendedData", 1)
    blob = data[data.index(b"_") + 1 :]
    for tag in re.findall(rb"<DataArray [^>]*/>", head):
        attributes = dict(re.findall(rb'(\w+)="([^"]*)"', tag))
        if attributes.get(b"Name") == name.encode():
            break
    else:
        sys.exit(f"{path}: no array {name}")
    at = int(attributes[b"offset"])
    integer = lambda place: int.from_bytes(blob[place : place + 8], "little")
    blocks = integer(at)
    sizes = [integer(at + 24 + 8 * i) for i in range(blocks)]
    place, raw = at + 24 + 8 * blocks, b""
    for size in sizes:
        raw += zlib.decompress(blob[place : place + size])
        place += size
    kind, width = {b"Float64": ("d", 8), b"Float32": ("f", 4)}[attributes[b"type"]]
    return struct.unpack(f"<{len(raw) // width}{kind}", raw), int(attributes.get(b"NumberOfComponents", b"1"))


def table(titles, rows):
    lines = ["| " + " | ".join(titles) + " |", "|" + "---|" * len(titles)]
    lines += ["| " + " | ".join(re.sub(r"(?<!\w)-(?=\d)", "−", str(cell)) for cell in row) + " |" for row in rows]
    return "\n".join(lines)


def refined(scene, cases, spacings, title="spacing, m"):
    """Errors of the displacement under refinement."""
    runs = [Run(scene, case) for case in cases]
    errors = [run.error() for run in runs]
    return [
        (spacing, run.particles, number(error), order)
        for spacing, run, error, order in zip(spacings, runs, errors, orders([float(s) for s in spacings], errors))
    ]


ERRORS = ["spacing, m", "particles", "L2 error of the displacement, m", "order"]


def bar_smooth():
    rows = []
    for label, cases in (("1", ["default", "h0125", "h0062"]), ("1.2", ["wide", "wide-h0125"])):
        runs = [Run("bar-smooth", case) for case in cases]
        spacings = [10 / (run.particles - 1) for run in runs]
        found = zip(runs, spacings, orders(spacings, [r.error() for r in runs]), orders(spacings, [r.error("velocity") for r in runs]))
        rows += [
            (label, f"{h:g}", number(run.error()), order, number(run.error("velocity")), other, number(run.drift, 2),
             run.report["newton"]["iterations"], run.steps, run.report["linear"]["factorisations"])
            for run, h, order, other in found
        ]
    return table(["`smoothing`", "spacing, m", "error of u, m", "order", "error of v, m/s", "order", "energy drift",
                  "Newton iterations", "steps", "factorisations"], rows)


def bar_shock():
    labels = {"none": "none", "default": "constant states, 40 particles", "n80": "80 particles", "n160": "160 particles",
              "limited": "limited states, 40 particles"}
    rows = []
    for case, label in labels.items():
        energy = Run("bar-shock", case).energy
        rows.append((label, f"{energy['initial']:.0f}", f"{energy['final']:.0f}", number(energy["max_relative_drift"], 2), number(energy["ledger_error"], 2)))
    return table(["upwinding", "energy at the start, J", "at t = 2 s, J", "largest change", "ledger"], rows)


def piston(scene, spacings):
    rows = []
    for weights in ("separate", "balanced"):
        cases = [f"{weights}-h{int(1000 * h):04}" for h in spacings]
        runs = [Run(scene, case) for case in cases]
        errors, velocities = [r.error() for r in runs], [r.error("velocity") for r in runs]
        for run, h, order, other in zip(runs, spacings, orders(spacings, errors), orders(spacings, velocities)):
            rows.append((weights, f"{h:g}", run.steps, number(run.error()), order, number(run.error("velocity")), other, number(run.drift, 2), run.report["linear"]["factorisations"]))
    return table(["weights", "spacing, m", "steps", "error of u, m", "order", "error of v, m/s", "order", "energy drift", "factorisations"], rows)


def piston_elastic():
    return piston("piston-elastic", [0.25, 0.125, 0.0625])


def block_piston():
    return piston("block-piston", [0.25, 0.125])


def piston_hyperelastic():
    labels = {"default": "Crank–Nicolson, Δt = 0.1 s", "default-100": "the same to 100 s",
              "conserving": "energy–momentum, Δt = 0.1 s", "conserving-100": "the same to 100 s",
              "conserving-fine": "energy–momentum, Δt = 0.01 s",
              "explicit": "TVD-RK2, Δt = 0.001 s"}
    rows = []
    for case, label in labels.items():
        run = Run("piston-hyperelastic", case)
        heights = run.probe("top.uy")[1]
        rows.append((label, f"{run.excess():.2f}", f"{min(heights):.3f}", f"{max(heights):+.3f}" if max(heights) < 5 else "lost", number(run.drift, 2), ending(run)))
    return table(["scheme", "step over the explicit limit", "lowest top, m", "highest, m", "energy drift", ""], rows)


def impact(scene):
    labels = {"default": ("0.25", "Crank–Nicolson, Δt = 0.05 s"), "explicit": ("0.25", "TVD-RK2, Δt = 0.001 s"),
              "fine": ("0.125", "Crank–Nicolson, Δt = 0.025 s"), "fine-explicit": ("0.125", "TVD-RK2, Δt = 0.001 s")}
    rows = []
    for case, (spacing, label) in labels.items():
        run = Run(scene, case)
        energy = run.energy
        rows.append((spacing, label, f"{run.excess():.2f}", f"{run.at('top')[1]:.4f}", f"{run.at('corner')[0]:.4f}",
                     f"{energy['initial']:.0f} to {energy['final']:.0f}", number(energy["ledger_error"])))
    return table(["spacing, m", "scheme", "step over the limit", "top, m", "corner, m", "energy, J", "ledger"], rows)


def impact_elastic():
    return impact("impact-elastic")


def impact_hyperelastic():
    return impact("impact-hyperelastic")


def dam_break():
    labels = {"default": ("0.25", "Crank–Nicolson, Δt = 0.01 s"), "explicit": ("0.25", "TVD-RK2, Δt = 0.001 s"),
              "fine": ("0.125", "Crank–Nicolson, Δt = 0.005 s"), "finer": ("0.0625", "Crank–Nicolson, Δt = 0.0025 s")}
    rows = []
    for case, (spacing, label) in labels.items():
        run = Run("dam-break", case)
        rows.append((spacing, label, f"{2.5 + run.at('front')[0]:.3f}", f"{2.5 + run.at('column_top')[1]:.3f}",
                     f"{100 * run.energy['max_relative_drift']:.1f} %", number(run.energy["ledger_error"])))
    return table(["spacing, m", "scheme", "front, m", "height at the wall, m", "largest change of the energy", "ledger"], rows)


def dam_break_c70():
    labels = {f"{kind}-c{c}": f"{kind}, c = {c} m/s" for kind in ("limited", "constant") for c in (10, 35, 70, 140)}
    labels |= {"fine": "limited, c = 70 m/s, spacing 0.0625 m", "separate": "limited, c = 70 m/s, separate weights"}
    rows = []
    unit = math.sqrt(2.5 / 9.81)
    for case, label in labels.items():
        run = Run("dam-break-c70", case)
        times, fronts = run.probe("front.ux")
        at = [f"{1 + value_at(times, fronts, T * unit) / 2.5:.3f}" for T in (0.80, 1.19, 1.50)]
        kinetic = run.table("history")["kinetic"][-1]
        lost = run.energy["dissipated"]
        rows.append((label, *at, f"{100 * lost / (lost + kinetic):.1f} %", number(run.energy["ledger_error"])))
    rows.append(("**measured** (Martin and Moyce 1952)", "1.44", "1.89", "2.33", "", ""))
    return table(["interface states", "x/a at T = 0.80", "1.19", "1.50", "dissipated, of it and kinetic", "ledger"], rows)


def plate_with_hole():
    labels = {"default": "rings, 0.0625 m", "coarse": "rings, 0.11538 m", "lattice": "square lattice, 0.11538 m"}
    rows = []
    for case, label in labels.items():
        run = Run("plate-with-hole", case)
        stress, width = point_data(run.path / "fields-00001.vtu", "stress")
        places, _ = point_data(run.path / "fields-00001.vtu", "Points")
        near = [a for a in range(run.particles) if math.hypot(places[3 * a], places[3 * a + 1]) < 1.2]
        largest = max(stress[width * a] for a in near) / 1e6
        rows.append((label, run.particles, f"{largest:.3f}", percent(largest, 3.0)))
    return table(["particles", "number", "largest σ_x at the hole over σ", "of 3"], rows)


def bracket():
    labels = {"default": "0.004, Δt = 10 µs", "h3": "0.003", "h2": "0.002", "short": "0.004, Δt = 5 µs"}
    rows = []
    for case, label in labels.items():
        run = Run("bracket", case)
        body = run.report["geometry"][0]
        values = [1e3 * u for u in run.probe("top.ux")[1]]
        rows.append((label, run.particles, body["open_edges"], f"{body['volume']:.4e}", number(body["volume_error"], 2),
                     f"{max(values):.3f}", f"{min(values):.3f}"))
    return table(["spacing, m", "particles", "open edges", "volume, m³", "its error", "top, farthest forth, mm", "and back, mm"], rows)


def beam(scene, reference, cases):
    rows = []
    labels = {"n": "cells", "balanced-n": "balanced"}
    for prefix, sizes in cases.items():
        runs = [Run(scene, f"{prefix}{n:02}") for n in sizes]
        tips = [[1e3 * u for u in run.at("tip")] for run in runs]
        # Towards the limit of the sequence: three levels, spacing halved.
        found = ["", ""] + [
            # None where the sequence turns.
            f"{math.log2(ratio):.2f}" if (ratio := (b[1] - a[1]) / (c[1] - b[1])) > 0 else ""
            for a, b, c in zip(tips, tips[1:], tips[2:])
        ]
        for n, run, tip, order in zip(sizes, runs, tips, found):
            rows.append((labels[prefix], n, run.particles, f"{tip[0]:.4f}", percent(tip[0], reference[0]), f"{tip[1]:.4f}", percent(tip[1], reference[1]), order))
    rows.append(("**reference**", "", "", f"{reference[0]:.4f}", "", f"{reference[1]:.4f}", "", ""))
    return table(["weights", "across", "particles", "u_x, mm", "", "u_y, mm", "", "order of u_y"], rows)


def csm1():
    return beam("csm1", (-7.18777, -66.1029), {"n": [5, 9, 17, 33], "balanced-n": [5, 9, 17]})


def csm2():
    return beam("csm2", (-0.469006, -16.9740), {"n": [5, 9, 17, 33], "balanced-n": [5, 9, 17]})


def csm3():
    labels = {"default": "cells, 5, Crank–Nicolson, Δt = 0.01 s", "n05": "cells, 5", "n09": "cells, 9", "n17": "cells, 17",
              "balanced-n05": "balanced, 5", "balanced-n09": "balanced, 9"}
    rows = []
    for case, label in labels.items():
        run = Run("csm3", case)
        times, heights = run.probe("tip.uy")
        time, depth = extremum(times, heights, 1)
        _, along = extremum(times, run.probe("tip.ux")[1], 1)
        late = [(t, h) for t, h in zip(times, heights) if t > 0.7]
        swing = extremum(*zip(*late), 1)[0] - time
        rows.append((label, f"{1e3 * depth:.2f}", percent(depth, -0.12964), f"{1e3 * along:.2f}", f"{time:.4f}", f"{swing:.4f}", percent(swing, 0.9145), number(run.drift, 2)))
    rows.append(("**reference**", "−129.64", "", "−29.28", "0.457", "0.9145", "", "0"))
    return table(["weights, particles across", "first trough, mm", "", "u_x there, mm", "at t, s", "to the next trough, s", "", "energy drift"], rows)


def oscillating(scene, labels, reference):
    rows = []
    for case, label in labels.items():
        run = Run(scene, case)
        times, heights = run.probe("tip.uy")
        swing = period(times, heights)
        rows.append((label, run.particles, f"{run.excess():.0f}", f"{swing:.5f}", percent(swing, reference), number(run.drift, 2)))
    rows.append(("**two-dimensional elasticity**", "", "", f"{reference:.5f}", "", "0"))
    return table(["across", "particles", "step over the explicit limit", "mean period, s", "", "energy drift"], rows)


def oscillating_plate():
    return oscillating("oscillating-plate", {"coarse": "4", "default": "6", "n11": "11"}, 0.25523)


def oscillating_plate_slot():
    return oscillating("oscillating-plate-slot", {"default": "6", "n11": "11"}, 0.26279)


def swinging_plate():
    return table(ERRORS, refined("swinging-plate", ["n11", "n21", "n41"], ["0.1", "0.05", "0.025"]))


def swinging_cube():
    sizes = [5, 7, 9, 13]
    return table(ERRORS, refined("swinging-cube", [f"n{n}" for n in sizes], [f"{1 / (n - 1):.4f}" for n in sizes]))


def manufactured_2d():
    rows = []
    for label, prefix in (("Crank–Nicolson", "n"), ("TVD-RK2", "explicit-n")):
        found = refined("manufactured-2d", [f"{prefix}{n}" for n in (11, 21, 41)], ["0.1", "0.05", "0.025"])
        rows += [(label, *row) for row in found]
    return table(["scheme", *ERRORS], rows)


def manufactured_3d():
    sizes = [5, 7, 9, 13]
    return table(ERRORS, refined("manufactured-3d", [f"n{n}" for n in sizes], [f"{1 / (n - 1):.4f}" for n in sizes]))


def spinning(scene, labels):
    rows = []
    for case, label in labels.items():
        run = Run(scene, case)
        report = run.report
        change = [number(v, 2) if v is not None else "–" for v in (report["angular_momentum_drift"], run.drift)]
        rows.append((label, f"{run.excess():.2g}", run.steps, *change, ending(run)))
    return table(["scheme", "step over the explicit limit", "steps", "change of the angular momentum", "of the energy", ""], rows)


def spinning_plate():
    return spinning("spinning-plate", {"default": "energy–momentum", "midpoint": "mid-point rule", "crank-nicolson": "Crank–Nicolson", "explicit": "velocity Verlet, `cfl = 0.3`"})


def spinning_cube():
    return spinning("spinning-cube", {"default": "energy–momentum", "midpoint": "mid-point rule", "crank-nicolson": "Crank–Nicolson"})


def column(scene, labels):
    rows = []
    for case, label in labels.items():
        run = Run(scene, case)
        corner = ", ".join(f"{x:.4f}" for x in run.at("corner", "position"))
        off = math.hypot(*run.at("tip")[:2])
        rows.append((label, run.particles, f"({corner})", number(off, 2), number(run.drift, 2)))
    return rows


def bending_column():
    labels = {"n04": "4", "n07": "7", "n10": "10", "default": "4, energy–momentum, Δt = 0.02 s"}
    rows = [(a, b, c, e) for a, b, c, _, e in column("bending-column", labels)]
    return table(["particles across", "particles", "corner at t = 0.5 s, m", "energy drift"], rows)


def twisting_column():
    labels = {"default": "4", "n06": "6", "n08": "8", "nu4999": "4, ν = 0.4999"}
    return table(["particles across", "particles", "corner at t = 0.1 s, m", "tip off the axis, m", "energy drift"], column("twisting-column", labels))


def main():
    for name in sys.argv[1:]:
        page = HERE / f"{name}.md"
        text = page.read_text(encoding="utf-8")
        found = globals()[name.replace("-", "_")]()
        new, count = re.subn(
            r"<!-- measured -->\n.*?<!-- end -->", lambda _: f"<!-- measured -->\n{found}\n<!-- end -->", text, flags=re.S
        )
        if count != 1:
            sys.exit(f"{page}: no markers")
        page.write_text(new, encoding="utf-8")
        print(f"{name}\n\n{found}\n")


if __name__ == "__main__":
    main()
