// Contacts in photographs: drag a circle or its edge, and save them all as presses.csv.
(function () {
  "use strict";
  const presses = JSON.parse(document.getElementById("contacts-data").textContent);
  const cards = [...document.querySelectorAll(".press")];

  function show(card, press) {
    const circle = card.querySelector(".contact"), middle = card.querySelector(".middle");
    const grip = card.querySelector(".grip");
    circle.setAttribute("cx", press.column); circle.setAttribute("cy", press.row);
    circle.setAttribute("r", press.radius);
    middle.setAttribute("cx", press.column); middle.setAttribute("cy", press.row);
    grip.setAttribute("cx", press.column + press.radius); grip.setAttribute("cy", press.row);
    card.querySelector("svg").classList.toggle("out", !press.used);
    for (const input of card.querySelectorAll("input[type=number]")) {
      if (document.activeElement !== input) input.value = press[input.name].toFixed(1);
    }
  }

  cards.forEach((card, index) => {
    const press = presses[index], svg = card.querySelector("svg");
    let held = null, offset = [0, 0];

    function place(event) {
      const at = new DOMPoint(event.clientX, event.clientY);
      const found = at.matrixTransform(svg.getScreenCTM().inverse());
      return [found.x, found.y];
    }

    svg.addEventListener("pointerdown", (event) => {
      const [x, y] = place(event);
      held = event.target.classList.contains("grip") ? "edge" : "middle";
      const inside = Math.hypot(x - press.column, y - press.row) <= press.radius;
      offset = inside ? [press.column - x, press.row - y] : [0, 0];
      svg.setPointerCapture(event.pointerId);
      move(event);
      event.preventDefault();
    });
    svg.addEventListener("pointermove", move);
    svg.addEventListener("pointerup", () => { held = null; });
    svg.addEventListener("pointercancel", () => { held = null; });

    function move(event) {
      if (!held) return;
      const [x, y] = place(event);
      if (held === "edge") {
        press.radius = Math.max(1, Math.hypot(x - press.column, y - press.row));
      } else {
        press.column = x + offset[0];
        press.row = y + offset[1];
        press.used = card.querySelector(".used").checked = true;
      }
      show(card, press);
    }

    for (const input of card.querySelectorAll("input[type=number]")) {
      input.addEventListener("input", () => {
        const value = input.valueAsNumber;
        if (Number.isFinite(value) && value > 0) { press[input.name] = value; show(card, press); }
      });
    }
    card.querySelector(".used").addEventListener("change", (event) => {
      press.used = event.target.checked;
      show(card, press);
    });
    show(card, press);
  });

  function cell(text) {
    return /[",\r\n]/.test(text) ? '"' + text.replaceAll('"', '""') + '"' : text;
  }

  document.getElementById("save").addEventListener("click", () => {
    const rows = presses.filter((press) => press.used).map((press) => [
      cell(press.file), press.diameter, press.column.toFixed(2), press.row.toFixed(2),
      press.radius.toFixed(2),
    ].join(","));
    const text = ["file,diameter,column,row,radius", ...rows, ""].join("\n");
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
    link.download = "presses.csv";
    link.click();
    URL.revokeObjectURL(link.href);
  });
})();
