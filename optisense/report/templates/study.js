// Interactive figures: point at a trial to read its numbers, click it for its picture and the command
// that writes its design into a folder. A page that is served (`live`) asks for new versions of itself, and for pictures.
(function () {
  "use strict";
  const data = JSON.parse(document.getElementById("study-data").textContent);
  const tip = document.getElementById("tip"), panel = document.getElementById("trial");
  const REACH = 14;  // pixels around a trial in which the pointer selects it
  const FEW = 5;  // parameters in the tip; the panel has all

  function element(name, text, ...children) {
    const made = document.createElement(name);
    if (text) made.textContent = text;
    made.append(...children);
    return made;
  }
  const title = (number) => `trial ${number}${data.trials[number].start ? " (the start)" : ""}`;

  function lines(number) {
    const trial = data.trials[number];
    return [title(number), ...data.objectives.map((name, i) => `${name}: ${trial.scores[i]}`),
      ...data.parameters.slice(0, FEW).map((name, i) => `${name} = ${trial.values[i]}`)].join("\n");
  }

  function table(names, values) {
    const made = element("table");
    names.forEach((name, i) => made.append(
      element("tr", "", element("th", name), element("td", values[i]))));
    return made;
  }

  let opener = null;
  function open(number) {
    const trial = data.trials[number], known = data.pictures[number];
    const button = element("button", "Close");
    button.type = "button";
    button.addEventListener("click", close);
    const tools = element("div", "", button);
    tools.className = "tools";
    const head = element("h2", title(number)), parts = [tools, head];
    if (known || data.live) {
      const image = element("img");
      image.className = "shot"; image.alt = `what the camera of trial ${number} sees`;
      image.src = known || `trial/${number}.png`;
      image.addEventListener("error", () => image.replaceWith(element("p", "There is no picture of it.")));
      parts.push(image);
    } else {
      parts.push(element("p", "The page has no picture of this trial. "
        + "optisense report --watch shows that of any."));
    }
    if (trial.failure) {
      const why = element("p", trial.failure);
      why.className = "notice";
      parts.push(why);
    }
    const scroll = element("div", "", table([...data.objectives, ...data.parameters],
      [...trial.scores, ...trial.values]));
    scroll.className = "scroll";
    const command = element("code", `${data.command} ${number} --out trial-${number}`);
    parts.push(scroll, element("p", "Apply it: ", command));
    panel.replaceChildren(...parts);
    panel.hidden = false;
    history.replaceState(null, "", `#trial-${number}`);
  }
  function close() {
    panel.hidden = true;
    history.replaceState(null, "", location.pathname + location.search);
    if (opener) opener.focus();
  }
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && !panel.hidden) close();
  });

  for (const figure of document.querySelectorAll(".interactive")) {
    const places = (data.figures[figure.dataset.figure] || [])
      .slice().sort((one, other) => one[1] - other[1] || one[2] - other[2]);
    const ring = element("div");
    ring.className = "ring"; ring.hidden = true;
    figure.append(ring);
    let chosen = -1;

    function choose(index) {
      chosen = index;
      ring.hidden = tip.hidden = index < 0;
      figure.style.cursor = index < 0 ? "" : "pointer";
      if (index < 0) return;
      const [number, x, y] = places[index], box = figure.getBoundingClientRect();
      ring.style.left = `${100 * x}%`; ring.style.top = `${100 * y}%`;
      tip.textContent = lines(number);
      const left = box.left + x * box.width, top = box.top + y * box.height;
      const right = left + 14 + tip.offsetWidth > window.innerWidth;
      tip.style.left = `${Math.max(4, right ? left - 14 - tip.offsetWidth : left + 14)}px`;
      tip.style.top = `${Math.max(4, Math.min(top, window.innerHeight - tip.offsetHeight - 4))}px`;
    }
    function nearest(event) {
      const box = figure.getBoundingClientRect();
      let found = -1, least = REACH;
      places.forEach(([, x, y], i) => {
        const apart = Math.hypot(box.left + x * box.width - event.clientX,
          box.top + y * box.height - event.clientY);
        if (apart < least) { least = apart; found = i; }
      });
      return found;
    }
    const show = () => {
      if (chosen < 0) return;
      opener = figure;
      open(places[chosen][0]);
    };
    figure.addEventListener("pointermove", (event) => choose(nearest(event)));
    figure.addEventListener("pointerleave", () => choose(-1));
    figure.addEventListener("blur", () => choose(-1));
    figure.addEventListener("click", (event) => { choose(nearest(event)); show(); });
    figure.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
      if (step && places.length) {
        event.preventDefault();
        choose(chosen < 0 ? 0 : (chosen + step + places.length) % places.length);
      }
      if (event.key === "Enter") show();
    });
  }

  const asked = /^#trial-(\d+)$/.exec(location.hash);
  if (asked && data.trials[asked[1]]) open(Number(asked[1]));
  if (data.live) setInterval(() => {
    fetch("version").then((answer) => answer.text()).then((version) => {
      if (version !== data.live) location.reload();
    }, () => {});  // the command that serves the page has ended
  }, 1500);
})();
