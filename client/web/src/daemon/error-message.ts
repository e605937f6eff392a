// The message that the user sees after a failed call.
import { Code, ConnectError } from "@connectrpc/connect";

/** The daemon names the method that a role forbids; users of the page see buttons. */
const ROLE = /^the token of .+ (has the role \w+), and \S+ (needs the role \w+)$/;

/** Returns the daemon's message, or without one, the meaning of the failure. */
export function messageOf(error: unknown): string {
  if (isTimeout(error)) return "The daemon did not answer in time.";
  if (error instanceof ConnectError && isFromDaemon(error)) return sentence(ROLE.test(error.rawMessage) ? error.rawMessage.replace(ROLE, "your token $1, and this $2") : error.rawMessage);
  if (error instanceof ConnectError || isNetworkFailure(error)) return "The daemon does not answer.";
  return error instanceof Error ? sentence(error.message) : String(error);
}

/** Whether this page gave a call up after its time. The daemon's own deadlines have the daemon's sentences. */
export function isTimeout(error: unknown): boolean {
  return error instanceof ConnectError && error.code === Code.DeadlineExceeded && (error.cause !== undefined || /^(the operation timed out)?$/i.test(error.rawMessage));
}

/** Runs a task; if it rejects, rejects with the message for the user. */
export async function worded<T>(act: () => Promise<T>): Promise<T> {
  try {
    return await act();
  } catch (error) {
    throw new Error(messageOf(error));
  }
}

/** Tells a status of the daemon from an error of the browser, which has a cause, or of a proxy. */
function isFromDaemon(error: ConnectError): boolean {
  if (error.cause !== undefined || error.rawMessage === "") return false;
  return !/^(HTTP \d|missing trailer|protocol error|unsupported content type)/i.test(error.rawMessage);
}

function isNetworkFailure(error: unknown): boolean {
  return error instanceof TypeError;
}

/** Messages of the daemon are fragments that fit after a colon; alone they get a capital and a full stop. */
function sentence(text: string): string {
  const trimmed = text.trim();
  const first = trimmed.charAt(0);
  // A first word that is a name stays unchanged.
  const start = /^[a-z]+[ ,;]/.test(trimmed) ? first.toUpperCase() : first;
  return start + trimmed.slice(1) + (/[.!?)]$/.test(trimmed) ? "" : ".");
}
