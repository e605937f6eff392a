// Whether programs that speak Zenoh reach the daemon of this page, and by which locator: the daemon's port says it.

/** How a program on this machine reaches the daemon over Zenoh. */
export type ZenohWay =
  | { kind: "reached"; locator: string }
  /** Only programs on the daemon's own machine reach it. */
  | { kind: "near"; locator: string }
  /** The daemon was started without Zenoh. */
  | { kind: "off" };

/** Bytes of the document that are read. */
const MAX_BYTES = 65536;

/** Asks the daemon. Undefined if it does not say. */
export async function zenohWay(): Promise<ZenohWay | undefined> {
  try {
    const answer = await fetch("/.well-known/simd.json");
    const text = answer.ok ? await answer.text() : "";
    if (text === "" || text.length > MAX_BYTES) return undefined;
    return wayOf(JSON.parse(text), location.hostname, location.protocol === "https:");
  } catch {
    return undefined;
  }
}

/** Reads the document, for a client that reaches the daemon's machine as `host`. The Python client chooses in the same way. */
export function wayOf(document: unknown, host: string, isTls: boolean): ZenohWay | undefined {
  if (typeof document !== "object" || document === null || !("zenoh" in document)) return undefined;
  const listens = textsOf(document.zenoh);
  const routers = "routers" in document ? textsOf(document.routers) : [];
  const bare = host.replace(/^\[|\]$/g, "");
  const isNear = isLoopback(bare);
  const isPreferred = (locator: string): boolean => locator.startsWith(isTls ? "tls/" : "tcp/");
  for (const locator of [...listens.filter(isPreferred), ...listens.filter((each) => !isPreferred(each))]) {
    const [, protocol = "", listening = "", port = ""] = /^(\w+)\/(.*):(\d+)$/.exec(locator) ?? [];
    if (isNear && !["0.0.0.0", "[::]"].includes(listening)) return { kind: "reached", locator };
    // This client knows one address of that machine.
    if (isNear || !isLoopback(listening)) return { kind: "reached", locator: `${protocol}/${bare.includes(":") ? `[${bare}]` : bare}:${port}` };
  }
  const [router] = routers;
  if (router !== undefined) return { kind: "reached", locator: router };
  const [first] = listens;
  return first === undefined ? { kind: "off" } : { kind: "near", locator: first };
}

function isLoopback(host: string): boolean {
  return /^(localhost|\[?::1\]?|127(\.\d+){3})$/.test(host);
}

function textsOf(value: unknown): string[] {
  return Array.isArray(value) ? value.filter((each): each is string => typeof each === "string") : [];
}
