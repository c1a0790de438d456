"use strict";

function element(name, text, children = []) {
  const made = document.createElement(name);
  made.textContent = text;
  made.append(...children);
  return made;
}

function named(reference) {
  const name = reference.split("/").pop();
  const link = element("a", name);
  link.href = `#${name}`;
  return link;
}

function limits(schema) {
  const texts = { minLength: "at least %s characters", maxLength: "at most %s characters", minItems: "at least %s",
    maxItems: "at most %s", maxProperties: "at most %s", exclusiveMinimum: "greater than %s", exclusiveMaximum: "less than %s" };
  return Object.keys(texts).filter((key) => key in schema).map((key) => texts[key].replace("%s", schema[key]));
}

// The type of a field as nodes: messages within it are links to their own tables.
function type(schema) {
  if (schema.$ref) return [named(schema.$ref)];
  if (schema.enum) return [schema.enum.map((one) => JSON.stringify(one)).join(", ")];
  if (schema.anyOf) return schema.anyOf.flatMap((one, at) => [...(at ? [" or "] : []), ...type(one)]);
  const limited = limits(schema).map((one) => `, ${one}`).join("");
  if (schema.prefixItems) return ["array of ", schema.prefixItems.map((one) => one.type).join(", ")];
  if (schema.items) return ["array of ", ...type(schema.items), limited];
  if (schema.additionalProperties) return ["object of ", ...type(schema.additionalProperties), limited];
  return [schema.type + limited];
}

function message([name, schema]) {
  const required = schema.required ?? [];
  const rows = Object.entries(schema.properties).map(([field, one]) => element("tr", "", [
    element("td", field + (required.includes(field) ? "" : " (optional)")), element("td", "", type(one)),
    element("td", one.description ?? "")]));
  const heading = element("h2", name);
  heading.id = name;
  const head = element("tr", "", ["Field", "Type", "Meaning"].map((one) => element("th", one)));
  return [heading, element("p", schema.description), element("table", "", [head, ...rows])];
}

function address([path, methods]) {
  return Object.entries(methods).map(([method, one]) => {
    const body = one.requestBody?.content["application/json"].schema;
    const answers = Object.entries(one.responses).flatMap(([code, each]) => {
      const [kind, content] = Object.entries(each.content)[0];
      return [`; ${code}: `, ...(content.schema ? type(content.schema) : [kind])];
    });
    return element("li", "", [element("code", `${method.toUpperCase()} ${path}`), ` ${one.summary}`,
      ...(body ? ["; takes ", ...type(body)] : []), ...answers]);
  });
}

async function show() {
  const described = await (await fetch("openapi.json")).json();
  document.getElementById("here").textContent = new URL(".", location.href);
  document.getElementById("described").replaceChildren(
    element("ul", "", Object.entries(described.paths).flatMap(address)),
    ...Object.entries(described.components.schemas).flatMap(message));
}

show().catch((error) => { document.getElementById("described").textContent = `The description could not be loaded: ${error}`; });
