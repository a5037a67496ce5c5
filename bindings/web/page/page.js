// Files in, a calibration in a worker, result out.

/** Size of a log that takes minutes, bytes. */
const LARGE = 5e7;

let chosen = [];
let worker = null;
/** The statements of the result that is shown. */
let used = "";

/** The engine, unpacked. */
async function unpacked() {
  const packed = Uint8Array.from(atob(at("engine").textContent), (c) => c.charCodeAt(0));
  const plain = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(plain).arrayBuffer();
}

/** Calibrates the chosen files in a new worker. */
async function calibrate() {
  if (!chosen.length) return;
  end();
  clear();
  at("again").hidden = false;
  const wrong = check();
  if (wrong.length) {
    const labels = wrong.map((field) => `“${label(field)}”`).join(", ");
    fail(`Correct ${labels}, then press “Calibrate again”. The page keeps ${names()}.`);
    return wrong[0].focus();
  }
  used = JSON.stringify(statements());
  tell("starting");
  at("activity").scrollIntoView({ block: "center" });
  const source = URL.createObjectURL(new Blob([at("worker").textContent], { type: "text/javascript" }));
  const mine = (worker = new Worker(source));
  URL.revokeObjectURL(source);
  let panic = "";
  mine.onmessage = ({ data: { kind, text, outputs } }) => {
    if (kind === "activity") return tell(text);
    if (kind === "draft") return showDraft(JSON.parse(text), names());
    if (kind === "note") return at("notes").append(element("p", text));
    if (kind === "caution") return at("caution").append(text);
    if (kind === "panic") return void (panic = text);
    end();
    if (kind === "done") {
      showReport(outputs);
      return markStale();
    }
    fail(kind === "error" ? text : crashed(panic || text));
  };
  mine.onerror = (event) => {
    event.preventDefault();
    end();
    fail(crashed(event.message));
  };
  const engine = await unpacked();
  mine.postMessage({ engine, files: chosen, statements: used });
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

function tell(activity) {
  at("activity").hidden = false;
  at("activity").querySelector("p").hidden = chosen.every((file) => file.size < LARGE);
  at("activity").querySelector("span").textContent = `${names()}: ${activity} …`;
}

/** Shows a message; its notes are folded. The options are opened if it may be about one. */
function fail(message) {
  const text = worded(message);
  const [main, ...notes] = text.split("\nnote: ");
  at("error").replaceChildren(main);
  if (text.includes("`turncal ")) at("error").append(quiet(COMMANDS));
  if (notes.length) {
    const paragraphs = notes.map((note) => element("p", note));
    at("error").append(element("details", element("summary", "Notes on the recording"), ...paragraphs));
  }
  at("error").hidden = false;
  at("statements").open ||= text !== message || filled().length > 0;
  at("error").scrollIntoView({ block: "center" });
}

function names() {
  return chosen.map((file) => file.name).join(", ");
}

/** Marks a result whose options are no longer those of the form. */
function markStale() {
  at("stale").hidden = at("verdict").hidden || JSON.stringify(statements()) === used;
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
form.onchange = check;
form.oninput = markStale;
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
