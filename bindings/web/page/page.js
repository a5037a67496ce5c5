"use strict";

const at = (id) => document.getElementById(id);
const form = at("form");

/** Size of a log that takes minutes, bytes. */
const LARGE = 5e7;

let chosen = [];
let worker = null;
let links = [];

/** The engine, unpacked. */
async function unpacked() {
  const packed = Uint8Array.from(atob(at("engine").textContent), (c) => c.charCodeAt(0));
  const plain = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(plain).arrayBuffer();
}

/** The fields of the form that are not empty. */
function statements() {
  const filled = [...form.elements].filter((field) => field.name && field.value.trim());
  const value = (field) => (field.type === "number" ? field.valueAsNumber : field.value.trim());
  return Object.fromEntries(filled.map((field) => [field.name, value(field)]));
}

/** Calibrates the chosen files in a new worker. */
async function calibrate() {
  if (!chosen.length || !form.reportValidity()) return;
  end();
  clear();
  tell("starting");
  at("activity").scrollIntoView({ block: "center" });
  const source = URL.createObjectURL(new Blob([at("worker").textContent], { type: "text/javascript" }));
  const mine = (worker = new Worker(source));
  URL.revokeObjectURL(source);
  let panic = "";
  mine.onmessage = ({ data: { kind, text, outputs } }) => {
    if (kind === "activity") return tell(text);
    if (kind === "draft") return showDraft(JSON.parse(text));
    if (kind === "panic") return void (panic = text);
    end();
    if (kind === "done") return showReport(outputs);
    fail(kind === "error" ? text : crashed(panic || text));
  };
  mine.onerror = (event) => {
    event.preventDefault();
    end();
    fail(crashed(event.message));
  };
  const engine = await unpacked();
  mine.postMessage({ engine, files: chosen, statements: statements() });
}

function crashed(reason) {
  return (
    `turncal stopped: ${reason}\nThe log may need more memory than a browser gives. Use a shorter log, or the ` +
    "command turncal on a computer."
  );
}

function end() {
  worker?.terminate();
  worker = null;
  at("activity").hidden = true;
}

/** Removes the previous result. */
function clear() {
  for (const id of ["error", "found", "report"]) at(id).hidden = true;
  links.forEach(URL.revokeObjectURL);
  links = [];
  at("again").disabled = false;
}

function tell(activity) {
  at("activity").hidden = false;
  at("activity").querySelector("p").hidden = chosen.every((file) => file.size < LARGE);
  at("activity").querySelector("span").textContent = `${names()}: ${activity} …`;
}

function fail(message) {
  at("error").hidden = false;
  at("error").textContent = message;
  // The message may name an option that is missing.
  at("statements").open ||= message.includes(" --");
  at("error").scrollIntoView({ block: "center" });
}

function names() {
  return chosen.map((file) => file.name).join(", ");
}

/** Shows what was found in a log, by field, value, certainty and reason, and the run.toml that says so. */
function showDraft({ fields, run }) {
  at("found").hidden = false;
  at("found").querySelector("h2").textContent = `Found in ${names()}`;
  at("found").querySelector("a").href = link(run);
  const rows = fields.map(([what, value, certainty, why]) => {
    const row = document.createElement("tr");
    row.append(cell("th", what), cell("td", value), cell("td", `${certainty}: ${why}`));
    return row;
  });
  at("found").querySelector("tbody").replaceChildren(...rows);
}

/** Shows the verdict, the files to download, and the other parts of the report. */
function showReport([report, calibration, ...exports]) {
  const page = new DOMParser().parseFromString(new TextDecoder().decode(report.bytes), "text/html");
  const [header, ...sections] = page.body.children;
  at("verdict").replaceChildren(header);
  at("details").replaceChildren(...sections.filter((section) => section.tagName !== "FOOTER"));
  const [own, others] = at("downloads").querySelectorAll("dl");
  own.replaceChildren(download(report), download(calibration));
  others.replaceChildren(...exports.map(download));
  at("report").hidden = false;
  at("report").scrollIntoView({ behavior: "smooth" });
}

function download({ name, about, bytes }) {
  const anchor = document.createElement("a");
  anchor.href = link(bytes);
  anchor.download = anchor.textContent = name;
  const [row, term] = ["div", "dt"].map((kind) => document.createElement(kind));
  term.append(anchor);
  row.append(term, cell("dd", about));
  return row;
}

/** The address of a file with this content. */
function link(content) {
  links.push(URL.createObjectURL(new Blob([content])));
  return links.at(-1);
}

function cell(kind, text) {
  const cell = document.createElement(kind);
  cell.textContent = text;
  return cell;
}

function choose(files) {
  chosen = [...files];
  calibrate();
}

at("files").onchange = ({ target }) => {
  choose(target.files);
  // The same file can be chosen again after it has changed.
  target.value = "";
};
form.onsubmit = (event) => {
  event.preventDefault();
  calibrate();
};
at("stop").onclick = end;
document.ondragover = (event) => {
  event.preventDefault();
  at("drop").classList.add("over");
};
document.ondragleave = () => at("drop").classList.remove("over");
document.ondrop = (event) => {
  event.preventDefault();
  at("drop").classList.remove("over");
  choose(event.dataTransfer.files);
};
