// The result: what was found in the log, verdict, files to download, report.

/** Meaning of names in messages of the engine. */
const COMMANDS = "Commands are those of the program turncal; names in [brackets] are sections of run.toml.";
/** What to do about a finding for which the page has no field. */
const ELSEWHERE = "→ State “Sensor” to use its data sheet, or drop a run.toml together with the log to state more.";

let links = [];

/** Removes the previous result. */
function clear() {
  for (const id of ["error", "result", "verdict", "found", "downloads", "stale"]) at(id).hidden = true;
  for (const id of ["verdict", "notes", "details", "caution"]) at(id).replaceChildren();
  links.forEach(URL.revokeObjectURL);
  links = [];
}

/** Shows the fields found in a log by name, value, certainty and reason, and the run.toml that states them. */
function showDraft({ fields, run }, log) {
  at("result").hidden = at("found").hidden = false;
  at("found").querySelector("h2").textContent = `Found in ${log}`;
  at("found").querySelector("a").href = link(run);
  const rows = fields.map(([what, value, certainty, why]) => {
    const row = element("tr", element("th", what), element("td", value));
    row.append(element("td", `${certainty}: ${worded(why)}`));
    row.className = certainty;
    return row;
  });
  at("found").querySelector("tbody").replaceChildren(...rows);
}

/** Shows the verdict, the files to download, and the other parts of the report. */
function showReport([report, calibration, ...exports]) {
  const text = worded(new TextDecoder().decode(report.bytes));
  // A number, its σ and its unit stay on one line.
  const joined = text.replace(/(\d) (?=[±°″µ%σ]|ppm|mm|m\/s|Hz|s\b)|± /g, (found) => found.trim() + "\u00a0");
  const page = new DOMParser().parseFromString(joined, "text/html");
  const [header, ...sections] = page.body.children;
  at("verdict").append(header);
  at("details").append(...sections.filter((section) => section.tagName !== "FOOTER"));
  explain(calibration.name);
  const [own, others] = at("downloads").querySelectorAll("dl");
  own.replaceChildren(download(report), download(calibration));
  others.replaceChildren(...exports.map(download));
  for (const id of ["result", "verdict", "downloads"]) at(id).hidden = false;
  at("result").scrollIntoView({ behavior: "smooth" });
}

/** Says how to use the values, and puts the findings into the words of the page. */
function explain(calibration) {
  const details = at("details");
  const where = `correction and bias are in ${calibration}`;
  const equation = `u = correction · (N − bias): N is the sensor's output, u the true value; ${where}.`;
  const headings = [...details.querySelectorAll("h2")];
  headings.find((heading) => heading.textContent === "Parameters")?.after(element("p", equation));
  for (const part of details.querySelectorAll(".findings p, .findings .next")) {
    const text = own(part.textContent);
    const isNext = part.matches(".next");
    part.textContent = text || (isNext ? ELSEWHERE : "");
  }
}

function download({ name, about, bytes }) {
  const anchor = element("a", name);
  anchor.href = link(bytes);
  anchor.download = name;
  return element("div", element("dt", anchor), element("dd", about));
}

/** The address of a file with this content. */
function link(content) {
  links.push(URL.createObjectURL(new Blob([content])));
  return links.at(-1);
}

function quiet(text) {
  const made = element("p", text);
  made.className = "quiet";
  return made;
}

function element(kind, ...content) {
  const made = document.createElement(kind);
  made.append(...content);
  return made;
}
