// Loads dropped robots: finds their files, uploads those that the daemon does not have, and spawns.
import type { DescriptionSource, SpawnEntityResponse } from "../gen/simd/v1/entity_pb";
import { AssetState, Base } from "../gen/simd/v1/entity_pb";
import { loadingOf, reportOf } from "../daemon/mapping";
import type { Services } from "../daemon/services";
import { loading, reports, unmeasured } from "../state/report";
import { scenes } from "../state/scene";
import { toast } from "../state/toasts";
import { selectedRobot } from "../state/view";
import { frame } from "../state/world";
import { includes, Locator, mayNameMore } from "./locator";
import { nextSpawnPosition } from "./spawn-position";
import { sha256 } from "./sha256";
import { MOUNT, nameOf, Tree } from "./tree";
import { findUrdfs } from "./urdfs";
import { searchedPlaces } from "./missing-file";

/** A dropped file and its path in the dropped folder. */
export interface DroppedFile {
  path: string;
  file: File;
}

/** Bytes of a file in one message: well below the limit of the daemon, and enough to make round trips negligible. */
const PART_BYTES = 1024 * 1024;

type Entities = Services["entities"];
type Source = Pick<DescriptionSource, "assets"> & {
  source: { case: "description"; value: string };
  missing: Record<string, { places: string[] }>;
};

/** Loads each URDF among the files. Rejects with the error of the daemon, or with one of its own. */
export async function loadDropped(entities: Entities, dropped: DroppedFile[]): Promise<void> {
  const files = new Map(dropped.map(({ path, file }) => [`${MOUNT}/${path.replace(/^\/+/, "")}`, file]));
  const urdfs = findUrdfs([...files.keys()]);
  const tree = new Tree(files.keys(), await manifestsOf(files));
  try {
    for (const urdf of urdfs) await load(entities, files, tree, urdf);
  } finally {
    loading.value = null;
  }
}

async function manifestsOf(files: Map<string, File>): Promise<Map<string, string>> {
  const manifests = [...files].filter(([path]) => nameOf(path) === "package.xml");
  return new Map(await Promise.all(manifests.map(async ([path, file]) => [path, await file.text()] as const)));
}

async function load(entities: Entities, files: Map<string, File>, tree: Tree, urdf: string): Promise<void> {
  loading.value = { what: nameOf(urdf), phase: "reading", done: 0, total: 0, item: "" };
  const bytes = await bytesOf(files, urdf);
  let prepared = await entities.prepareDescription({ urdf: bytes });
  const locator = new Locator(tree, urdf);
  const found: Found = { hashes: {}, paths: new Map(), missing: {}, known: new Map() };
  const sent = new Set<string>();
  // What an SDF or MJCF includes names more, and so does a mesh: pictures, and materials. A file is looked for once, so that
  // this ends.
  for (;;) {
    const named = prepared.assets.map((asset) => asset.uri).filter((uri) => !(uri in found.hashes || uri in found.missing));
    await find(files, locator, named, found);
    if (!named.some((uri) => uri in found.hashes)) break;
    prepared = await entities.prepareDescription({ urdf: bytes, assets: found.hashes });
    const lacking = prepared.assets.filter((asset) => asset.state === AssetState.LACKING);
    const hashes = new Set(lacking.flatMap((asset) => found.hashes[asset.uri] ?? []).filter((hash) => !sent.has(hash)));
    await upload(entities, files, prepared.name, found, hashes);
    for (const hash of hashes) sent.add(hash);
    if ([...hashes].some((hash) => includes(urdf) || mayNameMore(found.paths.get(hash) ?? ""))) {
      prepared = await entities.prepareDescription({ urdf: bytes, assets: found.hashes });
    }
  }
  const what = prepared.name === "" ? nameOf(urdf) : prepared.name;
  const spawned = await spawn(entities, what, {
    source: { case: "description", value: prepared.description },
    assets: found.hashes,
    missing: found.missing,
  }, prepared.models.length > 0);
  keepReport(spawned, prepared.models.length > 0);
}

/** The files of the URIs of a robot. */
interface Found {
  /** By URI. */
  hashes: Record<string, string>;
  /** By hash. */
  paths: Map<string, string>;
  /** By URI. */
  missing: Record<string, { places: string[] }>;
  /** Hashes by path: a visual and its collision often share a file. */
  known: Map<string, string>;
}

async function find(files: Map<string, File>, locator: Locator, uris: string[], found: Found): Promise<void> {
  for (const uri of uris) {
    const result = locator.find(uri);
    if ("why" in result) {
      const places = searchedPlaces(uri, result).map((place) => place.replace(`${MOUNT}/`, ""));
      found.missing[uri] = { places };
      continue;
    }
    const { path } = result;
    const hash = found.known.get(path) ?? (await sha256(await bytesOf(files, path)));
    found.known.set(path, hash);
    found.paths.set(hash, path);
    found.hashes[uri] = hash;
  }
}

async function upload(
  entities: Entities,
  files: Map<string, File>,
  what: string,
  found: Found,
  lacking: Set<string>,
): Promise<void> {
  const parts = [...lacking].map((hash) => ({ hash, path: found.paths.get(hash) ?? "" }));
  const total = parts.reduce((sum, { path }) => sum + (files.get(path)?.size ?? 0), 0);
  let sent = 0;
  for (const { hash, path } of parts) {
    const bytes = await bytesOf(files, path);
    for (let offset = 0; offset === 0 || offset < bytes.length; offset += PART_BYTES) {
      loading.value = { what, phase: "uploading", done: sent, total, item: nameOf(path) };
      const data = bytes.subarray(offset, offset + PART_BYTES);
      const [totalBytes, at] = [BigInt(bytes.length), BigInt(offset)];
      await entities.uploadAsset({ sha256: hash, totalBytes, offset: at, data });
      sent += data.length;
    }
  }
}

async function spawn(
  entities: Entities,
  what: string,
  source: Source,
  saysBase: boolean,
): Promise<SpawnEntityResponse | undefined> {
  // With a fixed base: most dropped robots are arms, which would fall in an empty world. An SDF or MJCF says it itself.
  const pose = { position: nextSpawnPosition(scenes.value, frame.value) };
  const base = saysBase ? Base.UNSPECIFIED : Base.FIXED;
  const request = { spawn: { source, allowRenaming: true, base, pose } };
  let spawned: SpawnEntityResponse | undefined;
  for await (const { event } of entities.spawnEntityWithProgress(request)) {
    if (event.case === "progress") loading.value = loadingOf(what, event.value);
    if (event.case === "spawned") spawned = event.value;
  }
  return spawned;
}

function keepReport(spawned: SpawnEntityResponse | undefined, saysBase: boolean): void {
  const name = spawned?.entity?.name;
  if (!spawned || name === undefined) throw new Error("The daemon ended the call without a result.");
  const report = reportOf(name, spawned.report);
  reports.value = new Map(reports.value).set(name, report);
  unmeasured.value = new Set(unmeasured.value).add(name);
  const others = spawned.others.map((other) => other.name);
  selectedRobot.value = name;
  const said = report.summary === "" ? `${[name, ...others].join(", ")} is loaded` : report.summary;
  toast("info", saysBase ? `${said}.` : `${said}. Its base is fixed to the world.`);
}

async function bytesOf(files: Map<string, File>, path: string): Promise<Uint8Array<ArrayBuffer>> {
  const file = files.get(path);
  if (!file) throw new Error(`${path} was not dropped.`);
  try {
    return new Uint8Array(await file.arrayBuffer());
  } catch {
    throw new Error(`${file.name} cannot be read: was it moved, or changed since it was dropped?`);
  }
}
