// The current video, which the page shows.
import { signal } from "@preact/signals";

/** A current video. */
export interface Film {
  /** Ends and saves it. */
  end(): void;
}

export const film = signal<Film | null>(null);
