// Loads dropped robots: finds their files, uploads those that the daemon lacks, and spawns.
import type { MessageInitShape } from "@bufbuild/protobuf";
import type { DescriptionSourceSchema, EntityInfo, SpawnEntityRequest, SpawnEntityRequestSchema, SpawnEntityResponse } from "../gen/simd/v1/entity_pb";
import { AssetState, Base, MeshShapes } from "../gen/simd/v1/entity_pb";
import { loadingOf, reportOf } from "../daemon/mapping";
import type { Services } from "../daemon/services";
import { loading, reports } from "../state/report";
import { toast } from "../state/toasts";
import { selectedRobot } from "../state/view";
import { includes, Locator, mayNameMore } from "./locator";
import { checkSize } from "./limits";
import { sha256 } from "./sha256";
import { uploadFile } from "./upload";
import { MOUNT, nameOf, Tree } from "./tree";
import { searchedPlaces } from "./missing-file";
import { expandXacro, isXacro, type Chosen } from "./xacro";

/** A dropped file and its path in the dropped folder. */
export interface DroppedFile {
  path: string;
  file: File;
}

/** Options of dropped robots. */
export interface LoadOptions {
  /** Empty stands for the name in the description. */
  name: string;
  /**
   * Position in the world, metres. Absent coordinates put the robot beside the others. Without all three it stands on the ground. With several
   * robots this is the position of the first.
   */
  position?: Partial<Place>;
  /** Rotation about the world's z, radians. */
  yaw: number;
  base: "described" | "fixed" | "free";
  /** Collision shape that is made from meshes. */
  meshes: "mesh" | "hull" | "parts";
  /** Factor of all lengths. */
  scale: number;
}

/** Position in the world, metres. */
interface Place {
  x: number;
  y: number;
  z: number;
}

/** Default options, the same as those of the other clients. */
export const DEFAULT_OPTIONS: LoadOptions = { name: "", yaw: 0, base: "described", meshes: "mesh", scale: 1 };

/** Maximum number of a xacro's messages that are shown. */
const MAX_MESSAGES = 3;

const BASES: Record<LoadOptions["base"], Base> = { described: Base.UNSPECIFIED, fixed: Base.FIXED, free: Base.FREE };
const SHAPES: Record<LoadOptions["meshes"], MeshShapes> = { mesh: MeshShapes.MESH, hull: MeshShapes.HULL, parts: MeshShapes.DECOMPOSITION };

type Entities = Services["entities"];
type Spawn = Exclude<MessageInitShape<typeof SpawnEntityRequestSchema>, SpawnEntityRequest>;
type Source = MessageInitShape<typeof DescriptionSourceSchema>;
/** Called for each loaded robot with the request and the chosen file. */
type OnLoaded = (entity: EntityInfo, request: Spawn, choice: Chosen) => void;
/** Called for each robot of one file. */
type OnLoadedOne = (entity: EntityInfo, request: Spawn) => void;

/** Loads descriptions that are among the files, one after the other. Rejects with the error of the daemon or of the page. */
export async function loadDropped(entities: Entities, dropped: DroppedFile[], chosen: readonly Chosen[], options = DEFAULT_OPTIONS, loaded: OnLoaded = () => undefined): Promise<void> {
  const files = new Map(dropped.map(({ path, file }) => [`${MOUNT}/${path.replace(/^\/+/, "")}`, file]));
  loading.value = { what: nameOf(chosen[0]?.path ?? ""), phase: "reading", done: 0, total: 0, item: "" };
  try {
    const tree = new Tree(files.keys(), await manifestsOf(files));
    let next = options;
    for (const choice of chosen) {
      await load(entities, files, tree, await descriptionOf(entities, files, choice), next, (...of) => loaded(...of, choice));
      // The other robots of its file stand beside it.
      const { y, ...rest } = next.position ?? {};
      if (y !== undefined) next = { ...options, position: rest };
    }
  } finally {
    loading.value = null;
  }
}

async function manifestsOf(files: Map<string, File>): Promise<Map<string, string>> {
  const manifests = [...files].filter(([path]) => nameOf(path) === "package.xml");
  return new Map(await Promise.all(manifests.map(async ([path, file]) => [path, await file.text()] as const)));
}

/** Reads a description; a xacro file is expanded first. */
async function descriptionOf(entities: Entities, files: Map<string, File>, choice: Chosen): Promise<Description> {
  const what = nameOf(choice.path);
  const urdf = `${MOUNT}/${choice.path.replace(/^\/+/, "")}`;
  loading.value = { what, phase: "reading", done: 0, total: 0, item: "" };
  checkSize(what, "description", files.get(urdf)?.size ?? 0);
  if (!isXacro(choice.path)) return { urdf, bytes: await bytesOf(files, urdf) };
  const expanded = await expandXacro(entities, files, choice);
  for (const message of expanded.messages.slice(0, MAX_MESSAGES)) toast("info", `${what}: ${message}`);
  return { urdf, bytes: expanded.urdf };
}

/** A description, and its place among the files. */
interface Description {
  urdf: string;
  bytes: Uint8Array<ArrayBuffer>;
}

async function load(entities: Entities, files: Map<string, File>, tree: Tree, { urdf, bytes }: Description, options: LoadOptions, loaded: OnLoadedOne): Promise<void> {
  loading.value = { what: nameOf(urdf), phase: "reading", done: 0, total: 0, item: "" };
  let prepared = await entities.prepareDescription({ urdf: bytes });
  const locator = new Locator(tree, urdf);
  const found: Found = { hashes: {}, paths: new Map(), missing: {}, known: new Map() };
  const sent = new Set<string>();
  // Files that an SDF or MJCF includes name more files. Meshes name pictures and materials. Each file is searched once, so the loop ends.
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
  const source = { source: { case: "description", value: prepared.description }, assets: found.hashes, missing: found.missing } as const;
  const request = requestOf(source, options);
  const spawned = await spawn(entities, what, request);
  const entity = keepReport(spawned, request.base !== Base.UNSPECIFIED);
  // With several robots, each would load all of them again.
  if (spawned?.others.length === 0) loaded(entity, request);
}

function requestOf(source: Source, { name, yaw, base, meshes, scale, position = {} }: LoadOptions): Spawn {
  const { x = 0, y = 0, z = 0 } = position;
  const pose = {
    position: { x, y, z },
    ...(yaw !== 0 && { orientation: { x: 0, y: 0, z: Math.sin(yaw / 2), w: Math.cos(yaw / 2) } }),
  };
  const free = { besideOthers: position.y === undefined, onGround: Object.values(position).every((value) => value === undefined) };
  return { source, name, allowRenaming: true, base: BASES[base], pose, ...free, meshShapes: SHAPES[meshes], ...(scale !== 1 && { scale }) };
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
    checkSize(nameOf(path), "file", files.get(path)?.size ?? 0);
    if (!found.known.has(path) && loading.value) loading.value = { ...loading.value, item: nameOf(path) };
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
    const before = sent;
    await uploadFile(entities, hash, bytes, (done) => {
      loading.value = { what, phase: "uploading", done: before + done, total, item: nameOf(path) };
    });
    sent += bytes.length;
  }
}

async function spawn(entities: Entities, what: string, request: Spawn): Promise<SpawnEntityResponse | undefined> {
  let spawned: SpawnEntityResponse | undefined;
  for await (const { event } of entities.spawnEntityWithProgress({ spawn: request })) {
    if (event.case === "progress") loading.value = loadingOf(what, event.value);
    if (event.case === "spawned") spawned = event.value;
  }
  return spawned;
}

/** Keeps the load report of the robot. Returns the robot. */
function keepReport(spawned: SpawnEntityResponse | undefined, isBaseChosen: boolean): EntityInfo {
  if (!spawned?.entity) throw new Error("The daemon ended the call without a result.");
  const { name } = spawned.entity;
  const report = reportOf(name, spawned.report);
  reports.value = new Map(reports.value).set(name, report);
  const others = spawned.others.map((other) => other.name);
  selectedRobot.value = name;
  const said = report.summary === "" ? `${[name, ...others].join(", ")} is loaded` : report.summary;
  const isFree = !isBaseChosen && spawned.entity.base === Base.FREE && others.length === 0;
  toast("info", isFree ? `${said}. Its base is free: choose a fixed base in the sheet to hold it in place.` : `${said}.`);
  return spawned.entity;
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
