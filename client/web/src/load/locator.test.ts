// The page finds dropped files as the other clients find files on a disk: both run the shared test vectors.
import { expect, test } from "vitest";
import cases from "../../../../server/formats/assets/vectors/paths.json";
import { Locator } from "./locator";
import { MOUNT, Tree } from "./tree";
import { searchedPlaces } from "./missing-file";

interface Case {
  name: string;
  files: Record<string, string>;
  urdf: string;
  links?: unknown;
  packages?: unknown;
  ros_package_path?: unknown;
  ament_prefix_path?: unknown;
  root?: unknown;
  find: { uri: string; path?: string; why?: string }[];
}

/** The cases without symbolic links, package maps, variables of ROS and asset roots, which a page does not have. */
const ofPages = (cases as unknown as Case[]).filter(
  (each) => !each.links && !each.packages && !each.ros_package_path && !each.ament_prefix_path && !each.root,
);

function treeOf(files: Record<string, string>): Tree {
  const mounted = Object.entries(files).map(([path, text]) => [`${MOUNT}/${path}`, text] as const);
  const manifests = new Map(mounted.filter(([path]) => path.endsWith("/package.xml")));
  return new Tree(
    mounted.map(([path]) => path),
    manifests,
  );
}

test("most of the shared cases apply to a page", () => {
  expect(ofPages.length).toBeGreaterThanOrEqual(7);
});

for (const each of ofPages) {
  test(each.name, () => {
    const locator = new Locator(treeOf(each.files), `${MOUNT}/${each.urdf}`);
    for (const { uri, path, why } of each.find) {
      const found = locator.find(uri.replaceAll("{tree}", MOUNT));
      const expected = path === undefined ? { why } : { path: `${MOUNT}/${path}` };
      expect("path" in found ? found : { why: found.why }, uri).toEqual(expected);
    }
  });
}

test("files that were dropped without a folder are found next to the urdf", () => {
  const locator = new Locator(treeOf({ "arm.urdf": "", "a.stl": "" }), `${MOUNT}/arm.urdf`);
  expect(locator.find("a.stl")).toEqual({ path: `${MOUNT}/a.stl` });
});

test("the report lists the paths that were tried for a missing file, and the reason for a refused one", () => {
  const locator = new Locator(treeOf({ "arm/urdf/arm.urdf": "", "arm/notes.txt": "" }), `${MOUNT}/arm/urdf/arm.urdf`);
  const missing = locator.find("package://arm/a.stl");
  const refused = locator.find("package://arm/notes.txt");
  if ("path" in missing || "path" in refused) throw new Error("nothing of it is there");
  expect(searchedPlaces("package://arm/a.stl", missing)).toContain(`${MOUNT}/arm/a.stl`);
  expect(searchedPlaces("package://arm/notes.txt", refused).at(-1)).toContain("not a mesh or an image");
});
