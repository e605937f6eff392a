// A restart of the daemon, and the robots of this page that it ended.
import { signal } from "@preact/signals";

/** A restart that the user has not answered. */
export interface Restart {
  /** When the page found the daemon again. */
  at: Date;
  /** Robots that this page can bring in again, at least one. */
  robots: readonly string[];
}

export const restarted = signal<Restart | null>(null);
