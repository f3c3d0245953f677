"use strict";
(() => {
  document.documentElement.classList.add("js");
  // Two pictures one over the other: the range says how much of the left one is seen.
  for (const slide of document.querySelectorAll(".slide")) {
    const range = slide.querySelector("input"), stage = slide.querySelector(".stage");
    const show = () => stage.style.setProperty("--at", range.value + "%");
    const follow = (event) => {
      if (!event.buttons) return;
      const box = stage.getBoundingClientRect();
      range.value = (100 * (event.clientX - box.left)) / box.width;
      show();
    };
    range.addEventListener("input", show);
    stage.addEventListener("pointerdown", (event) => {
      stage.setPointerCapture(event.pointerId);
      follow(event);
    });
    stage.addEventListener("pointermove", follow);
    show();
  }
  // Tables by any column, up and down; rows without a number last.
  const order = (a, b, sign) => {
    const [x, y] = [a.dataset.v, b.dataset.v];
    if (x === undefined && y === undefined) return sign * a.textContent.localeCompare(b.textContent);
    if (x === undefined || y === undefined) return x === undefined ? 1 : -1;
    return sign * (x - y);
  };
  for (const table of document.querySelectorAll("table")) {
    const body = table.tBodies[0], heads = [...table.tHead.rows[0].cells];
    if (body.rows.length < 2) continue;
    heads.forEach((head, column) => {
      const button = document.createElement("button");
      button.type = "button";
      button.append(...head.childNodes);
      head.append(button);
      button.addEventListener("click", () => {
        const sign = head.getAttribute("aria-sort") === "ascending" ? -1 : 1;
        for (const other of heads) other.removeAttribute("aria-sort");
        head.setAttribute("aria-sort", sign > 0 ? "ascending" : "descending");
        body.append(...[...body.rows].sort((a, b) => order(a.cells[column], b.cells[column], sign)));
      });
    });
  }
})();
