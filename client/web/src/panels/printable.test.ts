// Replacements of hidden characters.
import { h } from "preact";
import { expect, test } from "vitest";
import { escapeHiddenCharacters, printable } from "./printable";

test("hidden characters are written out", () => {
  expect(printable("arm\u202e\u200b\u0007\u{e0041}")).toBe("arm\\u{202e}\\u{200b}\\u{7}\\u{e0041}");
});

test("visible characters stay, in any script", () => {
  for (const text of ["", "shoulder_joint-1", "手首 é \u{1f916}", "two\nlines"]) expect(printable(text)).toBe(text);
});

test("joiners within words of scripts that have them are spelling, and elsewhere they are hidden characters", () => {
  for (const text of ["\u0645\u06cc\u200c\u062e\u0648\u0627\u0647\u0645", "\u{1f468}\u200d\u{1f469}\u200d\u{1f467}"]) expect(printable(text)).toBe(text);
  expect(printable("ar\u200dm \u200c\u0645")).toBe("ar\\u{200d}m \\u{200c}\u0645");
});

test("each element has printable text and labels, and a component unchanged properties", () => {
  escapeHiddenCharacters();
  const name = "a\u202eb";
  const element = h("span", { title: name, "data-robot": name }, "robot ", name, h("b", null, name), [name], 3, null);
  expect(element.props.title).toBe("a\\u{202e}b");
  expect((element.props as unknown as Record<string, unknown>)["data-robot"]).toBe(name);
  const children = element.props.children as unknown as [string, string, { props: { children: string } }, string[], number, null];
  expect([children[0], children[1], children[3]]).toEqual(["robot ", "a\\u{202e}b", ["a\\u{202e}b"]]);
  expect(children[2].props.children).toBe("a\\u{202e}b");
  const Row = ({ name }: { name: string }) => h("i", null, name);
  expect(h(Row, { name }).props.name).toBe(name);
});
