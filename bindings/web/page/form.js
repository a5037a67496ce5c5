"use strict";

// Options: statements of a user about a log.

const at = (id) => document.getElementById(id);
const form = at("form");

/** Numbers that a field takes, in words and as a test. */
const LIMITS = {
  rate: ["above 0, such as 102.4", (hertz) => hertz > 0],
  latitude: ["from −90 to 90, such as −31.4", (degrees) => Math.abs(degrees) <= 90],
  height: ["from −500 to 9000, such as 280", (metres) => metres >= -500 && metres <= 9000],
  gravity: ["from 9.7 to 9.9, such as 9.8072", (gravity) => gravity >= 9.7 && gravity <= 9.9],
};

/** The text of a field, without the quotes in which messages show a value. */
const typed = (field) => field.value.trim().replace(/^(['"`])(.*)\1$/, "$2").trim();

/** The value of a field. A number may have a decimal point or comma; NaN is none that the field takes. */
function value(field) {
  const [, isPossible] = LIMITS[field.name] ?? [];
  if (!isPossible) return typed(field);
  const number = Number(typed(field).replace(",", ".").replace("−", "-"));
  return Number.isFinite(number) && isPossible(number) ? number : NaN;
}

/** The fields that are not empty. */
const filled = () => [...form.elements].filter((field) => field.name && typed(field));

const statements = () => Object.fromEntries(filled().map((field) => [field.name, value(field)]));

/** Says beside each field with a wrong number what it takes; the wrong fields. */
function check() {
  const wrong = filled().filter((field) => Number.isNaN(value(field)));
  for (const [name, [limits]] of Object.entries(LIMITS)) {
    const field = form.elements[name];
    const isWrong = wrong.includes(field);
    field.setAttribute("aria-invalid", isWrong);
    const message = isWrong ? `Found ${typed(field)}, expected a number ${limits}.` : "";
    field.labels[0].querySelector("small").textContent = message;
  }
  return wrong;
}

/** The name of a field on the page. */
const label = (field) => field.labels[0].firstChild.textContent.split(",")[0].trim();

/** The fields of run.toml that have a field on the page. */
const FIELDS = { latitude_deg: "latitude", height_m: "height", gravity_m_s2: "gravity", sample_period_s: "rate" };

/** What only the command and run.toml have: options, commands, sections. */
const FOREIGN = /`|--[a-z]|\bturncal (allan|apply|calibrate|check|explain|export|init)\b|\[[a-z_.]+\]|\.run_toml/;

/** A text of the engine in the words of the page: the names of its fields instead of options and of run.toml's. */
function worded(text) {
  const field = (name) => form.elements[name];
  const named = text.replace(/`?--([a-z-]+)`?/g, (option, name) => (field(name) ? `“${label(field(name))}”` : option));
  return named.replace("`salvage = true`", "$& in run.toml");
}

/** A text about the result in the words of the page, without sentences that do not apply to it. */
function own(text) {
  const names = new RegExp(Object.keys(FIELDS).join("|"), "g");
  const field = (name) => `“${label(form.elements[FIELDS[name]])}”`;
  const named = worded(text).replace(names, field).replace(/(?<=”[^.]*) in \[(site|imu)\]/g, "");
  const parts = named.split(/(?<=[.!?]) (?=\p{Lu})|(?<=;) /u).filter((part) => !FOREIGN.test(part));
  return parts.join(" ").replace(/;$/, ".");
}
