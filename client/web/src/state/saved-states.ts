// A saved state of the world, as the list shows it.

/** Bytes that a browser keeps while it saves a file. */
export const MAX_FILE = 1 << 30;

export interface SavedState {
  name: string;
  /** Simulated seconds of the moment that was kept. */
  simTime: number;
  /** How many there are in it. */
  robots: number;
  /** Name of the client that saved it, for people. */
  owner: string;
}
