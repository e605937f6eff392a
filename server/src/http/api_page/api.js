// Lists the methods of /openapi.json and calls them.

const document_ = await (await fetch("/openapi.json")).json();
const element = (id) => document.getElementById(id);
const schemaOf = ({ $ref }) => document_.components.schemas[$ref.split("/").at(-1)];
const unary = Object.entries(document_.paths).filter(([, { post }]) => "application/json" in post.requestBody.content);
let chosen;

/** Returns the type of a field in a few words. */
function typeOf(schema) {
  if (schema.$ref) {
    const named = schemaOf(schema);
    return named.enum ? named.enum.join(" | ") : schema.$ref.split("/").at(-1);
  }
  if (schema.type === "array") return `list of ${typeOf(schema.items)}`;
  if (schema.additionalProperties) return `${typeOf(schema.additionalProperties)} by name`;
  return schema.contentEncoding ?? schema.format ?? [schema.type].flat()[0];
}

function describe(name, depth = 0, above = []) {
  const { properties = {} } = document_.components.schemas[name] ?? {};
  return Object.entries(properties).flatMap(([field, schema]) => {
    const inner = (schema.items ?? schema).$ref?.split("/").at(-1);
    const nested = inner && depth < 3 && !above.includes(inner) ? describe(inner, depth + 1, [...above, inner]) : [];
    return [`${"  ".repeat(depth)}${field}: ${typeOf(schema)}`, ...nested];
  });
}

function show() {
  const text = element("request").value.trim() || "{}";
  const quoted = text.replaceAll("'", "'\\''");
  element("curl").textContent = `curl -H 'Content-Type: application/json' -d '${quoted}' ${location.origin}${chosen}`;
}

function choose(path, button) {
  chosen = path;
  for (const other of document.querySelectorAll("[aria-current]")) other.removeAttribute("aria-current");
  button.setAttribute("aria-current", "true");
  element("name").textContent = path.slice("/simd.v1.".length);
  element("request").value = "{}";
  element("answer").textContent = element("status").textContent = "";
  element("send").disabled = false;
  const request = document_.paths[path].post.requestBody.content["application/json"].schema.$ref.split("/").at(-1);
  element("fields").textContent = describe(request).join("\n") || "none";
  show();
}

function list() {
  const words = element("filter").value.toLowerCase();
  const items = [];
  let service;
  for (const [path, { post }] of unary) {
    if (!path.toLowerCase().includes(words)) continue;
    if (post.tags[0] !== service) {
      service = post.tags[0];
      const title = document.createElement("h2");
      title.textContent = service;
      items.push(title);
    }
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = path.split("/").at(-1);
    if (path === chosen) button.setAttribute("aria-current", "true");
    button.addEventListener("click", () => choose(path, button));
    items.push(button);
  }
  const rows = items.map((item) => {
    const row = document.createElement("li");
    row.append(item);
    return row;
  });
  element("methods").replaceChildren(...rows);
}

element("filter").addEventListener("input", list);
element("request").addEventListener("input", show);
element("call").addEventListener("submit", async (event) => {
  event.preventDefault();
  element("status").textContent = "…";
  const headers = { "content-type": "application/json" };
  const token = element("token").value;
  if (token) headers.authorization = `Bearer ${token}`;
  try {
    const response = await fetch(chosen, { method: "POST", headers, body: element("request").value || "{}" });
    const text = await response.text();
    element("status").textContent = `${response.status} ${response.statusText}`;
    try {
      element("answer").textContent = JSON.stringify(JSON.parse(text), null, 2);
    } catch {
      element("answer").textContent = text;
    }
  } catch (error) {
    element("status").textContent = `The daemon does not answer: ${error.message}`;
  }
});
list();
