// A restart of the daemon, and the robots of this page that it ended.
import { signal } from "@preact/signals";

/** A restart that the user has not answered. */
export interface Restart {
  /** Time at which the page found the daemon again. */
  at: Date;
  /** Robots that this page can load again, at least one. */
  robots: readonly string[];
}

export const restarted = signal<Restart | null>(null);
