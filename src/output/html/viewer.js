"use strict";
// Draws the particles of this file: no library, no network. Frames are float32 in base64: positions, then one
// number per particle for each field.
(function () {
  const element = (id) => document.getElementById(id);
  const data = JSON.parse(element("particles").textContent);
  const view = element("view"), canvas = element("canvas");

  // Without WebGL 2, or when it is lost, the still picture takes the place of the view.
  function giveUp(why) {
    canvas.hidden = true;
    canvas.style.display = "none";
    for (const id of ["legend", "axes", "controls"]) element(id).hidden = true;
    element("still").hidden = false;
    element("help").hidden = false;
    element("help").textContent = "This browser shows a picture only: " + why;
    view.dataset.state = "picture";
  }

  const gl = canvas.getContext("webgl2", { alpha: false, antialias: true, preserveDrawingBuffer: true });
  if (!gl) return giveUp("it has no WebGL 2.");

  const vertexSource = `#version 300 es
    precision highp float;
    in vec3 position; in float value; in float edge;
    uniform mat3 turn; uniform vec3 middle; uniform vec2 shift;
    uniform vec2 scale; uniform float pixels; uniform float eye; uniform float radius; uniform float line;
    uniform vec2 range;
    out float at; out float flawed; out float reach; out float size; out float deep;
    void main() {
      vec3 seen = turn * (position - middle);
      float near = eye > 0.0 ? eye / max(eye - seen.z, 0.05 * eye) : 1.0;
      at = clamp((value - range.x) / (range.y - range.x), 0.0, 1.0);
      flawed = (value - value == 0.0) ? 0.0 : 1.0;
      deep = seen.z / radius;
      reach = edge / radius * 0.55;
      gl_Position = vec4((seen.xy * near + shift) * scale, clamp(-0.45 * deep, -0.99, 0.99), 1.0);
      size = 2.0 * (0.5 * edge * near * pixels + line);
      gl_PointSize = max(size, 1.5);
      bool lost = !(abs(position.x) + abs(position.y) + abs(position.z) < 1e30);
      if (lost) { gl_Position = vec4(4.0, 4.0, 4.0, 1.0); }
    }`;
  const fragmentSource = `#version 300 es
    precision highp float;
    in float at; in float flawed; in float reach; in float size; in float deep;
    uniform sampler2D map; uniform int look;
    out vec4 colour;
    void main() {
      vec2 p = 2.0 * gl_PointCoord - 1.0; p.y = -p.y;
      float off = dot(p, p);
      if (off > 1.0) discard;
      vec3 base = flawed > 0.5 ? vec3(1.0, 0.0, 1.0) : texture(map, vec2(at * 255.0 / 256.0 + 0.5 / 256.0, 0.5)).rgb;
      float z = sqrt(1.0 - off);
      gl_FragDepth = gl_FragCoord.z;
      // The edge of a disc covers part of a pixel.
      float cover = clamp(0.5 * size * (1.0 - sqrt(off)) + 0.25, 0.0, 1.0);
      if (look == 0) { colour = vec4(base, cover); }
      else if (look == 1) { colour = vec4(0.125, 0.125, 0.125, cover); }
      else {
        float lit = dot(vec3(p, z), vec3(-0.36, 0.48, 0.8));
        float light = min(1.0, 0.56 + 0.5 * max(lit, -0.2));
        if (size > 9.0 && off > 0.88) light = 0.45;
        colour = vec4(base * light, 1.0);
        gl_FragDepth = clamp(0.5 - 0.225 * (deep + reach * z), 0.0, 1.0);
      }
    }`;

  function shader(kind, source) {
    const one = gl.createShader(kind);
    gl.shaderSource(one, source);
    gl.compileShader(one);
    if (!gl.getShaderParameter(one, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(one) || "shader");
    return one;
  }
  const program = gl.createProgram();
  try {
    gl.attachShader(program, shader(gl.VERTEX_SHADER, vertexSource));
    gl.attachShader(program, shader(gl.FRAGMENT_SHADER, fragmentSource));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) || "link");
  } catch (error) {
    return giveUp(error.message);
  }
  canvas.addEventListener("webglcontextlost", (event) => { event.preventDefault(); giveUp("it lost its graphics."); });
  gl.useProgram(program);
  const uniform = (name) => gl.getUniformLocation(program, name);

  function numbers(text) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return new Float32Array(bytes.buffer);
  }
  const unpacked = new Map();
  function frame(index) {
    if (!unpacked.has(index)) {
      if (unpacked.size > 60) unpacked.delete(unpacked.keys().next().value);
      unpacked.set(index, numbers(data.frames[index]));
    }
    return unpacked.get(index);
  }
  const edges = data.edges ? numbers(data.edges) : new Float32Array(data.count).fill(data.edge);

  function attribute(name, components) {
    const buffer = gl.createBuffer(), at = gl.getAttribLocation(program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, components, gl.FLOAT, false, 0, 0);
    return (values) => { gl.bindBuffer(gl.ARRAY_BUFFER, buffer); gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW); };
  }
  const setPositions = attribute("position", data.dim), setValues = attribute("value", 1), setEdges = attribute("edge", 1);

  // 256 colours of a map from the few that are stored.
  function colours(signed) {
    const map = data.maps[signed ? 1 : 0], all = new Uint8Array(256 * 4);
    for (let i = 0; i < 256; i++) {
      const place = i / 255 * (map.length - 1), low = Math.min(Math.floor(place), map.length - 2), part = place - low;
      for (let c = 0; c < 3; c++) all[4 * i + c] = Math.round(map[low][c] * (1 - part) + map[low + 1][c] * part);
      all[4 * i + 3] = 255;
    }
    return all;
  }
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);

  const space = data.dim === 3;
  const bound = (axis) => data.bounds[axis] || [0, 0];
  const middle = [0, 1, 2].map((axis) => (bound(axis)[0] + bound(axis)[1]) / 2);
  const sides = [0, 1, 2].map((axis) => bound(axis)[1] - bound(axis)[0] + 2 * data.edge * (axis < data.dim ? 1 : 0));
  const radius = Math.max(Math.hypot(...sides) / 2, 1e-30);
  const start = { azimuth: -Math.PI / 3, elevation: Math.PI / 6, zoom: 1, shift: [0, 0] };
  let looking = { ...start, shift: [0, 0] };
  let now = 0, field = 0, playing = null;

  // Rows: to the right, upwards, towards the viewer.
  function directions() {
    if (!space) return [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    const sa = Math.sin(looking.azimuth), ca = Math.cos(looking.azimuth);
    const se = Math.sin(looking.elevation), ce = Math.cos(looking.elevation);
    return [[-sa, ca, 0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]];
  }

  // Pixels of the canvas per metre.
  function pixelsPerMetre() {
    const wide = space ? 2 * radius : sides[0], tall = space ? 2 * radius : Math.max(sides[1], 1e-30);
    return looking.zoom * 0.92 * Math.min(canvas.width / Math.max(wide, 1e-30), canvas.height / tall);
  }

  // Low and high end of the colours: of all frames, or of this one.
  function range() {
    const chosen = data.fields[field];
    if (!element("own").checked) return [chosen.low, chosen.high];
    let low = Infinity, high = -Infinity;
    for (const value of frame(now).subarray((data.dim + field) * data.count, (data.dim + field + 1) * data.count)) {
      if (Math.abs(value) < 1e30) { low = Math.min(low, value); high = Math.max(high, value); }
    }
    if (low > high) return [0, 1];
    const most = Math.max(Math.abs(low), Math.abs(high));
    return chosen.signed ? [-most, most] : [low, high];
  }

  function draw() {
    const density = window.devicePixelRatio || 1;
    const width = Math.max(1, Math.round(canvas.clientWidth * density));
    const height = Math.max(1, Math.round(canvas.clientHeight * density));
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    gl.viewport(0, 0, width, height);
    gl.clearColor(1, 1, 1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const rows = directions(), pixels = pixelsPerMetre(), chosen = data.fields[field];
    gl.uniformMatrix3fv(uniform("turn"), false, [0, 1, 2].flatMap((column) => rows.map((row) => row[column])));
    gl.uniform3fv(uniform("middle"), middle);
    gl.uniform2fv(uniform("shift"), looking.shift);
    gl.uniform2f(uniform("scale"), 2 * pixels / width, 2 * pixels / height);
    gl.uniform1f(uniform("eye"), space && element("perspective").checked ? 3.5 * radius : 0);
    gl.uniform1f(uniform("radius"), radius);
    const [low, top] = range();
    gl.uniform2f(uniform("range"), low, top > low ? top : low + (Math.abs(low) || 1));
    element("legend-low").textContent = short(low);
    element("legend-high").textContent = short(top);
    const size = Number(element("size").value) * pixels;
    const pass = (look, factor, line) => {
      gl.uniform1i(uniform("look"), look);
      gl.uniform1f(uniform("pixels"), factor * size);
      gl.uniform1f(uniform("line"), line * density);
      gl.drawArrays(gl.POINTS, 0, data.count);
    };
    if (space) {
      gl.enable(gl.DEPTH_TEST);
      gl.disable(gl.BLEND);
      pass(2, 1.1, 0);
    } else {
      gl.disable(gl.DEPTH_TEST);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
      // Small discs cover the plane, large ones touch.
      const factor = data.edge * size < 8 * density ? 1.5 : 1;
      pass(1, factor, 1);
      pass(0, factor, 0);
    }
    if (space) drawAxes(rows);
    view.dataset.frame = now;
    view.dataset.field = chosen.label;
  }

  function drawAxes(rows) {
    const ends = ["x", "y", "z"].map((name, axis) => {
      const x = 28 * rows[0][axis], y = -28 * rows[1][axis];
      return `<line x2="${x}" y2="${y}" stroke="#202020" stroke-width="1.5"/>` +
        `<text x="${1.35 * x}" y="${1.35 * y + 4}" font-size="13" text-anchor="middle">${name}</text>`;
    });
    element("axes").firstElementChild.innerHTML = ends.join("");
  }

  const short = (number) => number === 0 ? "0" : Number(number.toPrecision(4)).toString().replace("-", "−");

  function showFrame(index) {
    now = Math.max(0, Math.min(data.times.length - 1, index));
    const all = frame(now), n = data.count;
    setPositions(all.subarray(0, data.dim * n));
    setValues(all.subarray((data.dim + field) * n, (data.dim + field + 1) * n));
    element("scrub").value = now;
    element("time").textContent = `t = ${short(data.times[now])} s (${now + 1}/${data.times.length})`;
    draw();
  }

  function showField(index) {
    field = index;
    const chosen = data.fields[field], map = colours(chosen.signed);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, map);
    const bar = element("legend-bar").getContext("2d"), image = bar.createImageData(1, 256);
    for (let i = 0; i < 256; i++) image.data.set(map.subarray(4 * (255 - i), 4 * (256 - i)), 4 * i);
    bar.putImageData(image, 0, 0);
    element("legend-label").textContent = chosen.label;
    showFrame(now);
  }

  function play(wanted) {
    clearInterval(playing);
    playing = null;
    element("play").textContent = wanted ? "❚❚ pause" : "▶ play";
    if (!wanted) return;
    if (now === data.times.length - 1) showFrame(0);
    const delay = Math.min(250, Math.max(33, 6000 / data.times.length));
    playing = setInterval(() => now < data.times.length - 1 ? showFrame(now + 1) : play(false), delay);
  }

  data.fields.forEach((one, index) => element("field").add(new Option(one.label, index)));
  element("scrub").max = data.times.length - 1;
  element("field").onchange = () => showField(Number(element("field").value));
  element("scrub").oninput = () => { play(false); showFrame(Number(element("scrub").value)); };
  element("play").onclick = () => play(playing === null);
  element("size").oninput = draw;
  element("perspective").onchange = element("own").onchange = draw;
  element("reset").onclick = () => { looking = { ...start, shift: [0, 0] }; draw(); };
  canvas.ondblclick = element("reset").onclick;
  view.onkeydown = (event) => {
    if (/^(INPUT|SELECT|BUTTON)$/.test(event.target.tagName)) return;
    if (event.key === " ") play(playing === null);
    else if (event.key === "ArrowRight") { play(false); showFrame(now + 1); }
    else if (event.key === "ArrowLeft") { play(false); showFrame(now - 1); }
    else return;
    event.preventDefault();
  };
  let held = null;
  canvas.onpointerdown = (event) => { held = event; canvas.setPointerCapture(event.pointerId); };
  canvas.onpointerup = canvas.onpointercancel = () => { held = null; };
  canvas.onpointermove = (event) => {
    if (!held) return;
    const right = event.clientX - held.clientX, down = event.clientY - held.clientY;
    held = event;
    if (space && !event.shiftKey) {
      looking.azimuth -= 0.01 * right;
      looking.elevation = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, looking.elevation + 0.01 * down));
    } else {
      const metres = (window.devicePixelRatio || 1) / pixelsPerMetre();
      looking.shift[0] += right * metres;
      looking.shift[1] -= down * metres;
    }
    draw();
  };
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    looking.zoom = Math.max(0.1, Math.min(200, looking.zoom * Math.exp(-0.0015 * event.deltaY)));
    draw();
  }, { passive: false });
  window.addEventListener("resize", draw);

  for (const id of ["controls", "legend", "help"]) element(id).hidden = false;
  element("axes").hidden = element("perspective-label").hidden = !space;
  element("help").className = "note";
  element("help").textContent = (space ? "Drag to turn, with shift to move" : "Drag to move") +
    "; wheel to zoom, double click to reset; space plays, arrows step.";
  setEdges(edges);
  now = data.times.length - 1;
  showField(0);
  const failure = gl.getError();
  view.dataset.state = failure ? "error " + failure : "ready";
})();
