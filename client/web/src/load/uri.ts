// Parses the `filename` attributes of a URDF: the same rules as in server/formats/assets/src/uri.rs.
import type { MissingReason } from "./missing-file";

/** A parsed URI. */
export type Reading =
  /** `package://NAME/rest` and `model://NAME/rest`. */
  | { kind: "package"; name: string; rest: string }
  /** `file:///path` and `/path`. */
  | { kind: "absolute"; path: string }
  /** A path from the URDF's folder. */
  | { kind: "relative"; path: string };

/** The possible readings of a URI, the literal one first: a `%20` is sometimes part of a name. */
export function readings(uri: string): Reading[] | MissingReason {
  const text = uri.trim().replaceAll("\\", "/");
  if (text === "") return "empty";
  if (text.includes("$(") || text.includes("${")) return "xacro";
  const literal = parse(text);
  if (typeof literal === "string" || !text.includes("%")) return typeof literal === "string" ? literal : [literal];
  const decodedText = decode(text);
  if (decodedText === undefined) return [literal];
  // Decoding may have introduced separators.
  const decoded = parse(decodedText.replaceAll("\\", "/"));
  if (typeof decoded === "string") return decoded;
  return JSON.stringify(decoded) === JSON.stringify(literal) ? [literal] : [literal, decoded];
}

/** Decodes percent codes as bytes of UTF-8; a `%` that starts no code is kept. */
function decode(text: string): string | undefined {
  const coded = text.replace(/%(?![0-9A-Fa-f]{2})/g, "%25");
  try {
    return decodeURIComponent(coded);
  } catch {
    return undefined;
  }
}

function parse(text: string): Reading | MissingReason {
  if (text.includes("\0")) return "null";
  const separator = text.indexOf("://");
  if (separator < 0) {
    // `file:/a` is short for `file:///a`.
    return pathOf(text.startsWith("file:/") ? text.slice("file:".length) : text);
  }
  const scheme = text.slice(0, separator).toLowerCase();
  const path = text.slice(separator + "://".length);
  switch (scheme) {
    case "package":
    case "model": {
      const slash = path.indexOf("/");
      if (slash < 0) return "no_file";
      const name = path.slice(0, slash);
      const rest = path.slice(slash + 1);
      if (name === "." || name === "..") return "no_package";
      if (rest === "") return "no_file";
      return { kind: "package", name, rest: rest.replace(/^\/+/, "") };
    }
    case "file": {
      const local = path.startsWith("localhost/") ? path.slice("localhost".length) : path;
      // Two slashes instead of three are a common mistake for a relative path.
      return local === "" ? "no_file" : pathOf(local);
    }
    case "http":
    case "https":
    case "ftp":
      return "network";
    default:
      return "scheme";
  }
}

function pathOf(text: string): Reading | MissingReason {
  if (/^\/*[A-Za-z]:\//.test(text)) return "windows";
  return text.startsWith("/") ? { kind: "absolute", path: text } : { kind: "relative", path: text };
}
