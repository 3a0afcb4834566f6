// The tactile image: read single pixels, draw a profile through them, mix the light groups.
(function () {
  "use strict";
  const canvas = document.getElementById("picture");
  const cross = document.getElementById("cross");
  const profile = document.getElementById("profile");
  const reading = document.getElementById("reading");
  const hint = document.getElementById("profile-hint");
  const context = canvas.getContext("2d", { willReadFrequently: true });
  const thumbs = [...document.querySelectorAll(".thumbs button")];
  const sliders = [...document.querySelectorAll(".mixer input")];
  const width = canvas.width, height = canvas.height;
  const pixels = {};
  let current = "picture", along = "row";
  let place = [Number(canvas.dataset.x), Number(canvas.dataset.y)];

  function load(button) {
    const image = button.querySelector("img");
    return image.decode().then(() => { pixels[button.dataset.name] = read(image); });
  }

  function read(image) {
    const scratch = document.createElement("canvas");
    scratch.width = width; scratch.height = height;
    const paper = scratch.getContext("2d");
    paper.drawImage(image, 0, 0, width, height);
    return paper.getImageData(0, 0, width, height);
  }

  // Light adds up, so other brightnesses of the groups need no new rendering. The layers are linear
  // levels as roots, in two pictures of 8 and 4 bits; overexposure and the tone curve come after.
  const mixing = JSON.parse(document.getElementById("mixing-data").textContent);
  const curve = Uint8Array.from(atob(mixing.curve), (letter) => letter.charCodeAt(0));
  const levels = {};

  async function loadLayer(group) {
    const { coarse, fine, least, step } = mixing.layers[group];
    const [high, low] = await Promise.all([coarse, fine].map((address) => {
      const image = new Image();
      image.src = address;
      return image.decode().then(() => read(image).data);
    }));
    const found = new Float32Array(3 * width * height);
    for (let i = 0; i < found.length; i++) {
      const k = 4 * Math.floor(i / 3) + i % 3, root = least + step * (16 * high[k] + low[k]);
      found[i] = root * Math.abs(root);
    }
    levels[group] = found;
  }

  function mixed() {
    if (sliders.every((slider) => Number(slider.value) === 100)) return pixels.picture;
    const sum = new Float32Array(3 * width * height);
    for (const slider of sliders) {
      const layer = levels[slider.dataset.group], weight = Number(slider.value) / 100;
      for (let i = 0; i < sum.length; i++) sum[i] += weight * layer[i];
    }
    if (mixing.spread) overexpose(sum, mixing.spread);
    const result = new ImageData(width, height), top = curve.length - 1;
    for (let i = 0, k = 0; i < sum.length; i += 3, k += 4) {
      for (let c = 0; c < 3; c++)
        result.data[k + c] = curve[Math.round(top * Math.sqrt(Math.max(0, Math.min(1, sum[i + c]))))];
      result.data[k + 3] = 255;
    }
    return result;
  }

  // Where a channel is overexposed, all three are lifted there and around, as by the simulated
  // sensor: optisense/design/responses/full_well.py.
  function overexpose(sum, { full, most, pixels: deviation }) {
    let excess = new Float32Array(width * height), any = false;
    for (let i = 0; i < excess.length; i++) {
      const over = Math.max(sum[3 * i], sum[3 * i + 1], sum[3 * i + 2]) - full;
      if (over > 0) { excess[i] = Math.min(most, over); any = true; }
    }
    if (!any) return;
    const reach = Math.floor(4 * deviation + 0.5), kernel = [];
    for (let d = -reach; d <= reach; d++) kernel.push(Math.exp(-0.5 * (d / (deviation || 1)) ** 2));
    const total = kernel.reduce((one, other) => one + other);
    for (const [count, stride, lines, along] of [[height, width, width, 1], [width, 1, height, width]])
      excess = blurred(excess, count, stride, lines, along, kernel.map((each) => each / total), reach);
    for (let i = 0; i < sum.length; i++) {
      const mask = Math.max(0, Math.min(1, excess[Math.floor(i / 3)]));
      sum[i] += mask * (full - Math.min(sum[i], full));
    }
  }

  // Along one axis; beyond the borders the picture goes on mirrored.
  function blurred(values, count, stride, lines, along, kernel, reach) {
    const result = new Float32Array(values.length);
    for (let line = 0; line < lines; line++)
      for (let i = 0; i < count; i++) {
        let sum = 0;
        for (let d = -reach; d <= reach; d++) {
          let at = (i + d) % (2 * count);
          if (at < 0) at += 2 * count;
          if (at >= count) at = 2 * count - 1 - at;
          sum += kernel[d + reach] * values[line * along + at * stride];
        }
        result[line * along + i * stride] = sum;
      }
    return result;
  }

  let shown;
  function show(name) {
    current = name;
    shown = name === "picture" ? mixed() : pixels[name];
    context.putImageData(shown, 0, 0);
    for (const thumb of thumbs) thumb.setAttribute("aria-pressed", thumb.dataset.name === name);
    mark();
  }

  function mark() {
    const ratio = window.devicePixelRatio || 1;
    const box = cross.getBoundingClientRect();
    cross.width = box.width * ratio; cross.height = box.height * ratio;
    const pen = cross.getContext("2d");
    pen.scale(ratio, ratio);
    const x = (place[0] + 0.5) / width * box.width, y = (place[1] + 0.5) / height * box.height;
    pen.lineWidth = 1;
    for (const [colour, dash] of [["rgba(0,0,0,0.55)", []], ["rgba(255,255,255,0.85)", [5, 5]]]) {
      pen.strokeStyle = colour; pen.setLineDash(dash);
      pen.beginPath();
      if (along === "row") { pen.moveTo(0, y); pen.lineTo(box.width, y); }
      else { pen.moveTo(x, 0); pen.lineTo(x, box.height); }
      pen.stroke();
    }
    pen.setLineDash([]);
    pen.strokeStyle = "#fff";
    pen.beginPath(); pen.arc(x, y, 4, 0, 7); pen.stroke();
    plot();
    say();
  }

  function at(image, x, y) {
    const k = 4 * (y * width + x);
    return [...image.data.slice(k, k + 3)];
  }

  function say() {
    const [x, y] = place, value = at(shown, x, y);
    let text = `column ${x}, row ${y}:  R ${value[0]}  G ${value[1]}  B ${value[2]}`;
    if (pixels.normals) {
      const normal = at(pixels.normals, x, y).map((v) => v / 127.5 - 1);
      const length = Math.hypot(...normal);
      if (length > 0.5 && length < 1.5) {
        const tilt = Math.acos(Math.min(1, normal[2] / length)) * 180 / Math.PI;
        text += `,  tilt ${tilt.toFixed(0)}°`;
      }
    }
    reading.textContent = text;
    hint.textContent = along === "row" ? "profile along the row" : "profile along the column";
  }

  function plot() {
    const ratio = window.devicePixelRatio || 1, box = profile.getBoundingClientRect();
    profile.width = box.width * ratio; profile.height = box.height * ratio;
    const pen = profile.getContext("2d");
    pen.scale(ratio, ratio);
    const left = 30, right = box.width - 8, top = 8, bottom = box.height - 8;
    const ink = getComputedStyle(profile).color;
    pen.font = "11px system-ui, sans-serif";
    pen.textAlign = "right"; pen.textBaseline = "middle";
    for (const level of [0, 128, 255]) {
      const y = bottom - level / 255 * (bottom - top);
      pen.globalAlpha = 0.2; pen.strokeStyle = ink;
      pen.beginPath(); pen.moveTo(left, y); pen.lineTo(right, y); pen.stroke();
      pen.globalAlpha = 0.7; pen.fillStyle = ink;
      pen.fillText(String(level), left - 5, y);
    }
    const count = along === "row" ? width : height;
    const step = (right - left) / Math.max(1, count - 1);
    pen.globalAlpha = 0.35;
    const here = left + step * (along === "row" ? place[0] : place[1]);
    pen.beginPath(); pen.moveTo(here, top); pen.lineTo(here, bottom); pen.stroke();
    pen.globalAlpha = 1; pen.lineWidth = 1.6;
    ["#e5484d", "#30a46c", "#3b82f6"].forEach((colour, channel) => {
      pen.strokeStyle = colour;
      pen.beginPath();
      for (let i = 0; i < count; i++) {
        const value = along === "row" ? at(shown, i, place[1]) : at(shown, place[0], i);
        pen.lineTo(left + step * i, bottom - value[channel] / 255 * (bottom - top));
      }
      pen.stroke();
    });
  }

  function point(event) {
    const box = cross.getBoundingClientRect();
    const x = Math.floor((event.clientX - box.left) / box.width * width);
    const y = Math.floor((event.clientY - box.top) / box.height * height);
    look(x, y);
  }
  function look(x, y) {
    place = [Math.max(0, Math.min(width - 1, x)), Math.max(0, Math.min(height - 1, y))];
    mark();
  }
  const STEPS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  cross.addEventListener("keydown", (event) => {
    const step = STEPS[event.key], far = event.shiftKey ? 10 : 1;
    if (!step) return;
    event.preventDefault();
    look(place[0] + far * step[0], place[1] + far * step[1]);
  });
  cross.addEventListener("pointermove", point);
  cross.addEventListener("pointerdown", point);
  cross.addEventListener("dblclick", () => { along = along === "row" ? "column" : "row"; mark(); });
  document.getElementById("turn-profile").addEventListener("click", () => {
    along = along === "row" ? "column" : "row";
    mark();
  });
  for (const thumb of thumbs) thumb.addEventListener("click", () => show(thumb.dataset.name));
  for (const slider of sliders)
    slider.addEventListener("input", () => {
      slider.parentElement.querySelector("output").textContent = slider.value + " %";
      show("picture");
    });
  const even = document.getElementById("mixer-reset");
  if (even) even.addEventListener("click", () => {
    for (const slider of sliders) {
      slider.value = 100;
      slider.parentElement.querySelector("output").textContent = "100 %";
    }
    show("picture");
  });
  Promise.all([...thumbs.map(load), ...Object.keys(mixing.layers).map(loadLayer)]).then(() => {
    document.getElementById("plain-picture").hidden = true;
    canvas.hidden = false; cross.hidden = false;
    show("picture");
    new ResizeObserver(mark).observe(canvas);
  });
})();
