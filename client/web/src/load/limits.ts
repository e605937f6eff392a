// Limits of the daemon that the page checks before it sends anything. A message that is too long ends the connection without an error.
import { limits } from "../state/world";

/** Throws the same sentence as other clients if bytes exceed the daemon's limit. */
export function checkSize(name: string, what: "description" | "file" | "message", bytes: number): void {
  const limit = limits.peek()?.[what === "file" ? "asset" : what];
  if (limit !== undefined && bytes > limit) throw new Error(`${name}: the size of the ${what} in bytes would be ${bytes}, and the limit is ${limit}.`);
}
