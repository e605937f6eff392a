// A saved state of the world, as the list shows it.

/** Maximum bytes that a browser holds while it saves a file. */
export const MAX_FILE = 1 << 30;

export interface SavedState {
  name: string;
  /** Simulated seconds of the saved moment. */
  simTime: number;
  /** Number of robots in it. */
  robots: number;
  /** Name of the client that saved it, for people. */
  owner: string;
}
