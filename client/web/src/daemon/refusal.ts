// What to tell people when a call did not succeed.
import { Code, ConnectError } from "@connectrpc/connect";

/** The daemon's own sentence or, where it did not say any, what that means. */
export function sentenceOf(error: unknown): string {
  if (error instanceof ConnectError && isFromDaemon(error)) return sentence(error.rawMessage);
  if (error instanceof ConnectError && error.code === Code.DeadlineExceeded) return "The daemon did not answer in time.";
  if (error instanceof ConnectError || isNetworkFailure(error)) return "The daemon does not answer.";
  return error instanceof Error ? sentence(error.message) : String(error);
}

/** A status that the daemon sent has metadata; what the browser says of a failed fetch has a cause. */
function isFromDaemon(error: ConnectError): boolean {
  if (error.cause !== undefined || error.rawMessage === "") return false;
  return !/^(HTTP \d|missing trailer|protocol error|unsupported content type)/i.test(error.rawMessage);
}

function isNetworkFailure(error: unknown): boolean {
  return error instanceof TypeError;
}

/** Refusals are fragments that fit after a colon; alone they begin with a capital and end with a stop. */
function sentence(text: string): string {
  const trimmed = text.trim();
  const first = trimmed.charAt(0);
  // A name stays as it is written.
  const start = /^[a-z]+[ ,;]/.test(trimmed) ? first.toUpperCase() : first;
  return start + trimmed.slice(1) + (/[.!?)]$/.test(trimmed) ? "" : ".");
}
