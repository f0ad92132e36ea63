// A list of the headings, closed at first, so that it does not push the result down; a short page
// needs none. A heading keeps its own identifier, to which others may link.
"use strict";
const headings = document.querySelectorAll("h2");
const contents = document.querySelector("nav.contents");
if (contents !== null && headings.length >= 4) {
  const details = document.createElement("details");
  const list = document.createElement("ol");
  details.append(Object.assign(document.createElement("summary"), { textContent: "Contents" }), list);
  headings.forEach((heading, number) => {
    const name = heading.textContent.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "");
    heading.id ||= name === "" || document.getElementById(name) !== null ? `part-${number}` : name;
    const link = Object.assign(document.createElement("a"), { href: `#${heading.id}` });
    link.textContent = heading.textContent;
    list.append(document.createElement("li"));
    list.lastChild.append(link);
  });
  contents.append(details);
  contents.hidden = false;
}

// A button beside each table copies it as text with tabs, which spreadsheets read. Without this
// script the page lacks nothing but that list.
const COPY = "Copy table";
for (const table of document.querySelectorAll("table")) {
  const button = document.createElement("button");
  button.type = "button";
  button.className = "copy";
  button.textContent = COPY;
  button.addEventListener("click", async () => {
    const lines = Array.from(table.rows, (row) =>
      Array.from(row.cells, (cell) =>
        [noFormula(cell.innerText.replace(/\s+/g, " ").trim()), ...Array(cell.colSpan - 1).fill("")].join("\t"),
      ).join("\t"),
    );
    await copy(lines.join("\n") + "\n");
    button.textContent = "Copied";
    setTimeout(() => (button.textContent = COPY), 2000);
  });
  (table.closest(".scroll") ?? table).after(button);
}

// A frame that shows all of its content needs no stop of the tabulator key.
const frames = new ResizeObserver((entries) => {
  for (const { target } of entries) {
    if (target.scrollWidth > target.clientWidth) target.tabIndex = 0;
    else target.removeAttribute("tabindex");
  }
});
for (const frame of document.querySelectorAll(".scroll")) frames.observe(frame);

// Names may come from outside: text that a spreadsheet would take for a formula is made text, as in
// the tables beside the page. Numbers with their signs and units stay.
function noFormula(text) {
  return /^[=@]/.test(text) || /^[+-](?![\d.,]+(\s?[%°])?$)/.test(text) ? `'${text}` : text;
}

async function copy(text) {
  if (navigator.clipboard !== undefined) {
    try {
      return await navigator.clipboard.writeText(text);
    } catch {
      // refused, as some browsers do for pages from a file
    }
  }
  const area = document.createElement("textarea");
  area.value = text;
  document.body.append(area);
  area.select();
  document.execCommand("copy");
  area.remove();
}
