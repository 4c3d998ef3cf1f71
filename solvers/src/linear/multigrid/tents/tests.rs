use super::*;

/// Points of two parts in the plane; some components are no unknowns.
fn tents() -> (Tents, Vec<[f64; 3]>) {
    let positions: Vec<[f64; 3]> =
        (0..90).map(|k| [f64::from(k % 9) + if k < 45 { 0.0 } else { 3.0 }, f64::from(k / 9) * 1.1, 0.0]).collect();
    let mut next = 0;
    let unknowns = (0..90)
        .map(|k| {
            let mut own = [NONE; 3];
            for own in own[..2].iter_mut().skip(usize::from(k % 7 == 0)) {
                (*own, next) = (next, next + 1);
            }
            own
        })
        .collect();
    let geometry =
        Geometry { dimension: 2, positions: positions.clone(), unknowns, parts: vec![(0..45, 1.0), (45..90, 1.0)] };
    (Tents::new(geometry, 2.5).expect("finite"), positions)
}

#[test]
fn tents_add_up_to_one_and_contain_linear_functions_of_each_part() {
    let (tents, positions) = tents();
    for (part, range) in [(0, 0..45), (1, 45..90)] {
        let seen: Vec<Vec<(usize, f64)>> = range.clone().map(|k| tents.at(k).iter().collect()).collect();
        for own in &seen {
            assert!((own.iter().map(|(_, value)| value).sum::<f64>() - 1.0).abs() < 1e-6, "part {part}");
        }
        // Values at the nodes from the lattice itself: the place of a node along x.
        let size = 2.5;
        let (lower, upper) = positions[range.clone()]
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, u), x| (l.min(x[0]), u.max(x[0])));
        let cells = ((upper - lower) / size).floor() + 1.0;
        let origin = lower - 0.5 * (cells * size - (upper - lower));
        let lattice = &tents.lattices[part];
        let place = |node: usize| {
            let entry = tents.numbers.iter().position(|&n| n as usize == node).expect("numbered") - lattice.offset;
            origin + (entry % lattice.counts[0]) as f64 * size
        };
        for (k, own) in range.zip(&seen) {
            let x: f64 = own.iter().map(|&(node, value)| value * place(node)).sum();
            assert!((x - positions[k][0]).abs() < 1e-5, "{x} at {:?}", positions[k]);
        }
    }
}

#[test]
fn restriction_is_the_transpose_of_prolongation_on_every_lattice() {
    let (tents, _) = tents();
    let size = tents.owners(180).iter().filter(|(point, _)| *point != NONE).count();
    let fine: Vec<f64> = (0..size).map(|i| (i as f64 * 0.37).sin()).collect();
    let coarse: Vec<f64> = (0..tents.nodes() * 2).map(|i| (i as f64 * 0.73).cos()).collect();
    let (mut up, mut down) = (vec![0.0; size], vec![0.0; coarse.len()]);
    tents.prolong(&coarse, &mut up, &mut Vec::new());
    tents.restrict(&fine, &mut down);
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    assert!((product(&up, &fine) - product(&down, &coarse)).abs() < 1e-12);
    let next = tents.coarser();
    assert!(next.nodes < tents.nodes());
    for node in 0..tents.nodes() {
        assert!((next.of(node).iter().map(|(_, weight)| weight).sum::<f64>() - 1.0).abs() < 1e-15);
    }
    let coarser: Vec<f64> = (0..next.nodes * 2).map(|i| (i as f64 * 0.31).cos()).collect();
    let (mut up, mut down) = (vec![0.0; coarse.len()], vec![0.0; coarser.len()]);
    next.prolong(2, &coarser, &mut up);
    next.restrict(2, &coarse, &mut down);
    assert!((product(&up, &coarse) - product(&down, &coarser)).abs() < 1e-12);
}
