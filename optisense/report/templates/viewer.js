// A small 3-D view of the design: orbit, pan, zoom, cut, and a legend that hides parts. A page may
// have two: one with the camera's rays, and one, `data-ways`, with the ways of photons.
function view3d(root, data) {
  "use strict";
  const stage = root.querySelector(".stage"), withWays = root.hasAttribute("data-ways");
  const canvas = stage.querySelector("canvas");
  // Without its drawing buffer, a view would be blank on paper.
  const options = { antialias: true, alpha: true, preserveDrawingBuffer: true };
  const gl = canvas.getContext("webgl2", options);
  if (!gl) {
    stage.querySelector(".failed").hidden = false;
    canvas.hidden = true;
    return;
  }

  const VERTEX = `#version 300 es
    uniform mat4 u_view, u_projection; uniform float u_lift;
    in vec3 a_point; in vec3 a_normal; out vec3 v_point, v_normal, v_eye;
    void main() {
      vec4 eye = u_view * vec4(a_point, 1.0);
      v_point = a_point; v_normal = mat3(u_view) * a_normal; v_eye = eye.xyz;
      gl_Position = u_projection * eye;
      gl_Position.z -= u_lift * gl_Position.w;
    }`;
  const SURFACE = `#version 300 es
    precision highp float;
    uniform vec4 u_colour, u_cut; uniform float u_glow;
    in vec3 v_point, v_normal, v_eye; out vec4 colour;
    void main() {
      if (dot(v_point, u_cut.xyz) > u_cut.w) discard;
      vec3 to_eye = normalize(-v_eye);
      vec3 n = normalize(v_normal);
      if (dot(n, to_eye) < 0.0) n = -n;
      float facing = dot(n, to_eye);
      float key = max(dot(n, normalize(vec3(-0.4, 0.7, 0.6))), 0.0);
      float shade = 0.42 + 0.28 * (0.5 + 0.5 * n.y) + 0.38 * key;
      float gloss = pow(max(dot(n, normalize(vec3(-0.4, 0.7, 0.6) + to_eye)), 0.0), 60.0);
      vec3 lit = mix(u_colour.rgb * shade + 0.25 * gloss, u_colour.rgb, u_glow);
      float edge = pow(1.0 - facing, 3.0);
      float alpha = u_colour.a >= 1.0 ? 1.0 : clamp(u_colour.a * (1.0 + 1.4 * edge), 0.0, 1.0);
      colour = vec4(lit * alpha, alpha);
    }`;
  const LINE = `#version 300 es
    precision highp float;
    uniform vec4 u_colour, u_cut; in vec3 v_point, v_normal, v_eye; out vec4 colour;
    void main() {
      if (dot(v_point, u_cut.xyz) > u_cut.w) discard;
      colour = vec4(u_colour.rgb * u_colour.a, u_colour.a);
    }`;

  function program(fragmentSource) {
    const made = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, fragmentSource]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw gl.getShaderInfoLog(shader);
      gl.attachShader(made, shader);
    }
    gl.bindAttribLocation(made, 0, "a_point");
    gl.bindAttribLocation(made, 1, "a_normal");
    gl.linkProgram(made);
    const uniforms = {};
    for (const name of ["u_view", "u_projection", "u_lift", "u_colour", "u_cut", "u_glow"])
      uniforms[name] = gl.getUniformLocation(made, name);
    return { made, uniforms };
  }
  const surfaces = program(SURFACE), lines = program(LINE);

  function decode(text, Type) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return new Type(bytes.buffer);
  }
  function buffer(target, values) {
    const made = gl.createBuffer();
    gl.bindBuffer(target, made);
    gl.bufferData(target, values, gl.STATIC_DRAW);
    return made;
  }
  function shape(points, normals, faces) {
    const vao = gl.createVertexArray();
    gl.bindVertexArray(vao);
    buffer(gl.ARRAY_BUFFER, points);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    if (normals) {
      buffer(gl.ARRAY_BUFFER, normals);
      gl.enableVertexAttribArray(1);
      gl.vertexAttribPointer(1, 3, gl.BYTE, true, 0, 0);
      buffer(gl.ELEMENT_ARRAY_BUFFER, faces);
    }
    gl.bindVertexArray(null);
    return { vao, count: faces ? faces.length : points.length / 3 };
  }

  const add = (a, b, s) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
  const sub = (a, b) => add(a, b, -1);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) =>
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => { const l = Math.hypot(...a) || 1; return [a[0] / l, a[1] / l, a[2] / l]; };
  function rgb(hex) {
    return [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);
  }

  // --- what there is to draw -----------------------------------------------------------------
  // Beside ways of photons solids are paler, so that the colours of the ways stay what they are, and
  // nothing is pressed in.
  const paleness = withWays ? 0.4 : 1;
  const parts = data.parts.filter((part) => !withWays || part.role !== "indenter");
  const things = parts.map((part) => {
    const points = decode(part.points, Float32Array);
    let middle = [0, 0, 0];
    for (let i = 0; i < points.length; i += 3)
      middle = add(middle, [points[i], points[i + 1], points[i + 2]], 3 / points.length);
    return {
      key: "part " + part.name, label: part.name, note: part.role.replace("_", " "),
      swatch: part.colour, colour: [...rgb(part.colour), paleness * part.alpha], middle, shown: true,
      cut: true,
      solid: shape(points, decode(part.normals, Int8Array), decode(part.faces, Uint32Array)),
      lines: shape(decode(part.edges, Float32Array)), glow: 0,
    };
  });
  for (const group of data.lights) things.push(lightThing(group));
  things.push(cameraThing(data.camera));
  for (const way of withWays ? data.ways : []) things.push(wayThing(way));
  for (const [name, label, hex, alpha] of withWays ? [] : [["seen", "chief rays", "#7a3fb8", 0.8],
    ["lost", "rays that miss the skin", "#8d97a3", 0.55]]) {
    const ends = data.rays[name] ? decode(data.rays[name], Float32Array) : [];
    if (ends.length) things.push(rayThing(label, hex, alpha, ends));
  }

  function rayThing(label, hex, alpha, ends) {
    return {
      key: label, label, note: "", swatch: hex, colour: [...rgb(hex), 1], middle: [0, 0, 0],
      shown: true, cut: false, glow: 0, lines: shape(ends), ink: [...rgb(hex), alpha],
      faint: [...rgb(hex).map((x) => 0.4 + 0.6 * x), 0.45 * alpha],
      solid: shape(new Float32Array(0), new Int8Array(0), new Uint32Array(0)),
    };
  }

  // The photons that end at one place; `choose` takes those of a light group, or of all.
  function wayThing(way) {
    const shapes = {}, every = [];
    for (const [group, text] of Object.entries(way.groups)) {
      const ends = decode(text, Float32Array);
      shapes[group] = shape(ends);
      for (const value of ends) every.push(value);
    }
    const thing = rayThing(way.label, way.colour, 1.0, new Float32Array(every));
    thing.faint = [...rgb(way.colour), 0.6];  // not paled: the colour tells where the photon ends
    const all = thing.lines, none = { vao: all.vao, count: 0 };
    const total = Object.values(way.photons).reduce((sum, each) => sum + each, 0);
    thing.choose = (group) => {
      thing.lines = group === "" ? all : shapes[group] || none;
      thing.noteShown.textContent = ` ${group === "" ? total : way.photons[group] || 0} photons`;
    };
    return thing;
  }

  function lightThing(group) {
    const points = [], normals = [], faces = [], rays = [], reach = data.size * 0.055;
    const brightest = Math.max(...group.colour, 1e-6);
    const colour = group.colour.map((value) => 0.08 + 0.92 * value / brightest);
    for (const light of group.lights) {
      const d = light.direction;
      const u = unit(cross(d, Math.abs(d[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0])), v = cross(d, u);
      const first = points.length / 3, sides = 20;
      for (let i = 0; i < sides; i++) {
        const turn = 2 * Math.PI * i / sides;
        points.push(...add(add(light.position, u, light.radius * Math.cos(turn)), v,
          light.radius * Math.sin(turn)));
        normals.push(...d.map((x) => Math.round(127 * x)));
        if (i > 1) faces.push(first, first + i - 1, first + i);
      }
      const tip = add(light.position, d, reach);
      rays.push(...light.position, ...tip);
      for (const side of [u, v]) for (const sign of [1, -1])
        rays.push(...tip, ...add(add(tip, d, -0.3 * reach), side, sign * 0.14 * reach));
    }
    const hex = "#" + colour.map((x) => Math.round(255 * x).toString(16).padStart(2, "0")).join("");
    return {
      key: "light " + group.name, label: group.name, note: group.lights.length + " lights",
      swatch: hex, colour: [...colour, 1], middle: [0, 0, 0], shown: true, cut: false, glow: 1,
      solid: shape(new Float32Array(points), new Int8Array(normals), new Uint32Array(faces)),
      lines: shape(new Float32Array(rays)), ink: [...colour.map((x) => 0.75 * x), 1],
    };
  }

  function cameraThing(camera) {
    const p = camera.position, c = camera.corners, segments = [];
    for (let i = 0; i < 4; i++) segments.push(...p, ...c[i], ...c[i], ...c[(i + 1) % 4]);
    // The small triangle marks the picture's upper edge.
    const top = add(c[0], sub(c[1], c[0]), 0.5);
    const width = Math.hypot(...sub(c[1], c[0])) || 1;
    const peak = add(top, camera.up, 0.1 * width);
    const left = add(top, sub(c[0], top), 0.16), right = add(top, sub(c[1], top), 0.16);
    segments.push(...left, ...peak, ...peak, ...right);
    const s = data.size * 0.018, back = add(p, camera.forward, -2.4 * s);
    const side = unit(cross(camera.forward, camera.up));
    const corner = (from, x, y) => add(add(from, side, x * s), camera.up, y * s);
    const signs = [[-1, -1], [1, -1], [1, 1], [-1, 1]];
    const box = [...signs.map(([x, y]) => corner(back, 1.5 * x, 1.5 * y)),
      ...signs.map(([x, y]) => corner(p, x, y))];
    const quads = [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
    const points = [], normals = [], faces = [];
    for (const quad of quads) {
      const n = unit(cross(sub(box[quad[1]], box[quad[0]]), sub(box[quad[2]], box[quad[0]])));
      const first = points.length / 3;
      for (const k of quad) { points.push(...box[k]); normals.push(...n.map((x) => Math.round(127 * x))); }
      faces.push(first, first + 1, first + 2, first, first + 2, first + 3);
    }
    return {
      key: "camera", label: "camera", note: camera.name, swatch: "#23282e",
      colour: [0.14, 0.16, 0.18, 1], middle: p, shown: true, cut: false, glow: 0,
      solid: shape(new Float32Array(points), new Int8Array(normals), new Uint32Array(faces)),
      lines: shape(new Float32Array(segments)), ink: [0.12, 0.14, 0.17, 0.85],
    };
  }

  // --- legend ---------------------------------------------------------------------------------
  const legend = root.querySelector(".legend");
  for (const thing of things) {
    const label = document.createElement("label");
    const box = document.createElement("input");
    box.type = "checkbox"; box.checked = true;
    box.addEventListener("change", () => { thing.shown = box.checked; draw(); });
    const swatch = document.createElement("span");
    swatch.className = "swatch"; swatch.style.background = thing.swatch;
    swatch.style.marginLeft = "5px";
    const note = document.createElement("small");
    note.textContent = " " + thing.note;
    thing.noteShown = note;
    label.append(box, swatch, thing.label, note);
    legend.append(label);
  }

  const groupChoice = root.querySelector(".light-group");
  function chooseGroup() {
    for (const thing of things) if (thing.choose) thing.choose(groupChoice.value);
  }
  if (groupChoice) {
    groupChoice.addEventListener("change", () => { chooseGroup(); draw(); });
    chooseGroup();
  }

  // --- the viewer's own camera -------------------------------------------------------------------
  const VIEWS = {
    corner: [-0.62, 0.42], front: [-Math.PI / 2, 0.02], above: [-Math.PI / 2, 1.5],
    below: [-Math.PI / 2, -1.5],
  };
  const HALF_HEIGHT = Math.tan(0.5 * 0.55);  // of what is seen, at a distance of 1
  let yaw, pitch, distance, target;
  function reset(name) {
    [yaw, pitch] = VIEWS[name] || VIEWS.corner;
    distance = data.size * 1.95;
    target = data.centre.slice();
    draw();
  }

  function axes() {
    const back = [Math.cos(pitch) * Math.cos(yaw), Math.cos(pitch) * Math.sin(yaw), Math.sin(pitch)];
    const right = [-Math.sin(yaw), Math.cos(yaw), 0];
    return { right, up: cross(back, right), back };
  }
  function matrices() {
    const { right, up, back } = axes();
    const eye = add(target, back, distance);
    const view = [
      right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
      -dot(right, eye), -dot(up, eye), -dot(back, eye), 1,
    ];
    const f = 1 / HALF_HEIGHT, near = distance * 0.02, far = distance + 4 * data.size;
    const aspect = canvas.width / canvas.height;
    const narrow = Math.min(1, aspect);
    const projection = [
      f * narrow / aspect, 0, 0, 0, 0, f * narrow, 0, 0,
      0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0,
    ];
    return { view, projection, eye };
  }

  const cutAxis = root.querySelector(".cut-axis"), cutAt = root.querySelector(".cut-at");
  function cutPlane() {
    const axis = Number(cutAxis.value);
    if (axis < 0) return [0, 0, 0, 1];
    const half = data.size / 2, plane = [0, 0, 0, 0];
    plane[axis] = 1;
    plane[3] = data.centre[axis] + (Number(cutAt.value) * 2 - 1) * half * 0.75;
    return plane;
  }
  cutAxis.addEventListener("change", () => draw());
  cutAt.addEventListener("input", () => {
    if (Number(cutAxis.value) < 0) cutAxis.value = "1";
    draw();
  });

  // --- drawing ------------------------------------------------------------------------------------
  let pending = false;
  function draw() {
    if (!pending) { pending = true; requestAnimationFrame(() => { pending = false; paint(); }); }
  }
  const arrows = root.querySelectorAll(".axes line"), letters = root.querySelectorAll(".axes text");
  function turnAxes() {
    const { right, up } = axes();
    for (let i = 0; i < 3; i++) {
      arrows[i].setAttribute("x2", 27 * right[i]);
      arrows[i].setAttribute("y2", -27 * up[i]);
      letters[i].setAttribute("x", 35 * right[i]);
      letters[i].setAttribute("y", -35 * up[i]);
    }
  }
  function paint() {
    turnAxes();
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (!width || !height) return;
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const { view, projection, eye } = matrices(), cut = cutPlane(), none = [0, 0, 0, 1];
    function use({ made, uniforms }, thing, colour, lift) {
      gl.useProgram(made);
      gl.uniformMatrix4fv(uniforms.u_view, false, view);
      gl.uniformMatrix4fv(uniforms.u_projection, false, projection);
      gl.uniform4fv(uniforms.u_colour, colour);
      gl.uniform4fv(uniforms.u_cut, thing.cut ? cut : none);
      gl.uniform1f(uniforms.u_lift, lift);
      if (uniforms.u_glow) gl.uniform1f(uniforms.u_glow, thing.glow);
    }
    function solid(thing) {
      use(surfaces, thing, thing.colour, 0);
      gl.bindVertexArray(thing.solid.vao);
      gl.drawElements(gl.TRIANGLES, thing.solid.count, gl.UNSIGNED_INT, 0);
    }
    const shown = things.filter((thing) => thing.shown);
    gl.disable(gl.CULL_FACE);
    shown.filter((thing) => thing.colour[3] >= 1).forEach(solid);
    for (const thing of shown) {
      if (!thing.lines.count) continue;
      use(lines, thing, thing.ink || [0.16, 0.2, 0.25, 0.55], 0.0004);
      gl.bindVertexArray(thing.lines.vao);
      gl.drawArrays(gl.LINES, 0, thing.lines.count);
    }
    // Translucent solids from far to near, each with its back faces first.
    const far = (thing) => Math.hypot(...sub(thing.middle, eye));
    gl.depthMask(false);
    gl.enable(gl.CULL_FACE);
    for (const thing of shown.filter((t) => t.colour[3] < 1).sort((a, b) => far(b) - far(a)))
      for (const face of [gl.FRONT, gl.BACK]) { gl.cullFace(face); solid(thing); }
    // Rays shine faintly through whatever hides them: most of a camera's way lies inside a body.
    gl.disable(gl.DEPTH_TEST);
    for (const thing of shown.filter((t) => t.faint)) {
      use(lines, thing, thing.faint, 0);
      gl.bindVertexArray(thing.lines.vao);
      gl.drawArrays(gl.LINES, 0, thing.lines.count);
    }
    gl.bindVertexArray(null);
  }

  // --- mouse, touch and keys ------------------------------------------------------------------------
  const pointers = new Map();
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  for (const end of ["pointerup", "pointercancel"])
    canvas.addEventListener(end, (event) => pointers.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const dx = event.clientX - before[0], dy = event.clientY - before[1];
    if (pointers.size === 2) {
      const [other] = [...pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
      const span = (at) => Math.hypot(at[0] - other[0], at[1] - other[1]) || 1;
      zoom(span(before) / span([event.clientX, event.clientY]));
      pan(dx / 2, dy / 2);
    } else if (event.shiftKey || event.buttons & 6) pan(dx, dy);
    else turn(dx, dy);
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    draw();
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(Math.max(-0.5, Math.min(0.5, event.deltaY * 0.0015))));
    draw();
  }, { passive: false });
  canvas.addEventListener("dblclick", () => reset("corner"));
  canvas.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [-12, 0], ArrowRight: [12, 0], ArrowUp: [0, -12], ArrowDown: [0, 12] };
    if (step[event.key]) { turn(...step[event.key]); event.preventDefault(); draw(); }
    if (event.key === "+" || event.key === "-") { zoom(event.key === "+" ? 0.9 : 1.1); draw(); }
  });
  function turn(dx, dy) {
    yaw -= dx * 0.008;
    pitch = Math.max(-1.55, Math.min(1.55, pitch + dy * 0.008));
  }
  function pan(dx, dy) {
    // What is at the target's distance stays under the pointer.
    const narrow = Math.min(1, canvas.clientWidth / canvas.clientHeight);
    const scale = 2 * HALF_HEIGHT * distance / (narrow * canvas.clientHeight);
    const { right, up } = axes();
    target = add(add(target, right, -dx * scale), up, dy * scale);
  }
  function zoom(factor) {
    distance = Math.max(data.size * 0.15, Math.min(data.size * 8, distance * factor));
  }
  for (const button of root.querySelectorAll("[data-view]"))
    button.addEventListener("click", () => reset(button.dataset.view));
  new ResizeObserver(() => draw()).observe(canvas);
  reset("corner");
}

(function () {
  const data = JSON.parse(document.getElementById("scene-data").textContent);
  for (const root of document.querySelectorAll(".view")) view3d(root, data);
})();
