// Makes text printable. Names come from untrusted files and programs. They may have characters that change the direction of
// text or are invisible. Every text that the page draws passes here, so that no panel needs a separate check.
import { options, type VNode } from "preact";

/** A letter or mark of a script whose letters join, or a part of an emoji. */
const JOINED = String.raw`(?:(?![\p{Script=Latin}\p{Script=Greek}\p{Script=Cyrillic}])[\p{L}\p{M}]|\p{Extended_Pictographic}|\p{Emoji_Modifier})`;
/** Joiners and non-joiners between two of these are spelling, as in Persian and in emoji of several people. */
const SPELLING = String.raw`(?<=${JOINED})[\u200c\u200d](?=${JOINED})`;
/** Unicode's categories Cc (control), Cf (format), Zl and Zp (line and paragraph separators); line breaks stay. */
const HIDDEN = new RegExp(String.raw`(?!\n)(?!${SPELLING})[\p{Cc}\p{Cf}\p{Zl}\p{Zp}]`, "gu");

/** Attributes that are shown or read aloud. */
const LABELS = ["title", "aria-label", "placeholder", "label", "alt"];

/** Returns the text with each hidden character as `\u{202e}`. */
export function printable(text: string): string {
  return text.replace(HIDDEN, (hidden) => `\\u{${hidden.codePointAt(0)?.toString(16) ?? ""}}`);
}

/** Makes a child of an element, or its children, printable. Objects other than text stay the same. */
function child(node: unknown): unknown {
  if (typeof node === "string") return printable(node);
  return Array.isArray(node) && node.some((each) => typeof each === "string" || Array.isArray(each)) ? node.map(child) : node;
}

/** From here on each element that Preact makes has printable text and labels. Components get their properties unchanged. */
export function escapeHiddenCharacters(): void {
  const before = options.vnode;
  options.vnode = (vnode: VNode) => {
    if (typeof vnode.type === "string") {
      const properties = vnode.props as Record<string, unknown>;
      if (properties.children !== undefined) properties.children = child(properties.children);
      for (const label of LABELS) {
        const value = properties[label];
        if (typeof value === "string") properties[label] = printable(value);
      }
    }
    before?.(vnode);
  };
}
