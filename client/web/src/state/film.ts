// The video that is being taken, which the page says.
import { signal } from "@preact/signals";

/** One that is being taken. */
export interface Film {
  /** Ends and saves it. */
  end(): void;
}

export const film = signal<Film | null>(null);
