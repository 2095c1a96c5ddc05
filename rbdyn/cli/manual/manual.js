// Contents fold by themselves on a narrow screen; the search lists headings whose text holds all words typed, folded modules last.
"use strict";
(() => {
  const box = document.getElementById("search"), found = document.getElementById("found");
  const count = document.getElementById("count"), contents = document.getElementById("contents");
  const MOST = 40;
  let blocks = null;

  // Elements of a chapter in order, those of folded modules as well.
  const flat = each => ["DETAILS", "SUMMARY"].includes(each.tagName) ? [...each.children].flatMap(flat) : [each];

  // Text from each heading to the next one, its chapter, and whether it is folded.
  function read() {
    const all = [];
    for (const section of document.querySelectorAll("main section")) {
      let block = null;
      for (const each of [...section.children].flatMap(flat)) {
        if (/^H[2-5]$/.test(each.tagName)) {
          const chapter = section.firstElementChild.textContent, folded = Boolean(each.closest("details"));
          block = { id: each.id, title: each.textContent, chapter, folded, text: "" };
          all.push(block);
        }
        block.text += " " + each.textContent.toLowerCase();
      }
    }
    return all;
  }

  function search() {
    const words = box.value.toLowerCase().split(/\s+/).filter(Boolean);
    contents.hidden = words.length > 0;
    found.replaceChildren();
    count.textContent = "";
    if (!words.length) return;
    blocks ??= read();
    const holds = text => words.every(word => text.includes(word));
    const hits = blocks.filter(block => holds(block.text));
    const late = hit => 2 * hit.folded - holds(hit.title.toLowerCase());
    hits.sort((one, other) => late(one) - late(other));
    count.textContent = hits.length > MOST ? `${MOST} of ${hits.length} places` : `${hits.length} places`;
    for (const hit of hits.slice(0, MOST)) {
      const item = document.createElement("li"), link = document.createElement("a"), where = document.createElement("small");
      link.href = "#" + hit.id;
      link.textContent = hit.title;
      where.textContent = hit.chapter;
      item.append(link, where);
      found.append(item);
    }
  }

  box.addEventListener("input", search);
  box.parentElement.hidden = false;
  if (matchMedia("(max-width: 60rem)").matches) contents.open = false;
})();
