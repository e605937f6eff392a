// A zip is opened in the page; a zip with false sizes or one that would fill the memory is refused.
import { expect, test } from "vitest";
import { openZip, ZIP_LIMITS } from "./zip";
import { zipOf, type ZipPart } from "./zip-fixture";

const open = (parts: ZipPart[], limits = ZIP_LIMITS, count = parts.length) => openZip(new File([zipOf(parts, count)], "arm.zip"), limits);
const paths = async (...names: string[]) => (await open(names.map((name) => ({ name, bytes: "x" })))).map(({ path }) => path);

test("files are unpacked as they were packed", async () => {
  const text = "<robot/>".repeat(1000);
  const files = await open([
    { name: "arm/urdf/arm.urdf", bytes: text },
    { name: "arm/meshes/é.stl", bytes: "stored", isStored: true },
  ]);
  expect(files.map(({ path }) => path)).toEqual(["arm/urdf/arm.urdf", "arm/meshes/é.stl"]);
  expect(await files[0]?.file.text()).toBe(text);
  expect(await files[1]?.file.text()).toBe("stored");
});

test("a zip without a top folder becomes one, since packages are found by the names of folders", async () => {
  expect(await paths("urdf/a.urdf", "meshes/a.stl")).toEqual(["arm/urdf/a.urdf", "arm/meshes/a.stl"]);
  expect(await paths("other/a.urdf", "other/a.stl")).toEqual(["other/a.urdf", "other/a.stl"]);
});

test("files that systems add are left out, and names do not lead outside", async () => {
  expect(await paths("d/", "d/a.urdf", "__MACOSX/d/._a.urdf", "d/.git/config")).toEqual(["d/a.urdf"]);
  expect(await paths("d/../../x/a.urdf", "/d/b.urdf", "d\\c.urdf")).toEqual(["d/x/a.urdf", "d/b.urdf", "d/c.urdf"]);
});

test("too many entries, too many bytes and too dense files are refused", async () => {
  const one = { name: "d/a.urdf", bytes: "x".repeat(100) };
  await expect(open([one, one], { ...ZIP_LIMITS, entries: 1 })).rejects.toThrow("has 2 entries, and the limit is 1");
  await expect(open([{ ...one, size: 3 << 20 }], { ...ZIP_LIMITS, bytes: 2 << 20 })).rejects.toThrow("3 MiB unpacked, and the limit is 2 MiB");
  await expect(open([{ name: "d/bomb", bytes: new Uint8Array(2 << 20) }])).rejects.toThrow("more than 250 times as long as it is packed");
});

test("a file that is longer or shorter than the list says is damaged", async () => {
  const bytes = "x".repeat(4000);
  for (const size of [10, 5000]) await expect(open([{ name: "d/a", bytes, size }])).rejects.toThrow("arm.zip is damaged");
  await expect(open([{ name: "d/a", bytes }], ZIP_LIMITS, 2)).rejects.toThrow("arm.zip is damaged");
});

test("a file that is not a zip, or is encrypted, is refused with that reason", async () => {
  await expect(openZip(new File(["<robot/>"], "arm.zip"))).rejects.toThrow("arm.zip is not a zip file");
  await expect(open([{ name: "d/a", bytes: "x", flags: 1 }])).rejects.toThrow("d/a in arm.zip is encrypted");
});
