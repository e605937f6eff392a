// Pictures of the scene that the user asks for.
import { signal } from "@preact/signals";

/** A picture that is asked for. */
export interface PictureRequest {
  /** Pixels. */
  width: number;
  height: number;
  taken: (picture: Promise<Blob>) => void;
}

/** Answered by the scene, as soon as it is set. */
export const pictureRequest = signal<PictureRequest | null>(null);

/** Whether the sheet for pictures is open. */
export const pictureOpen = signal(false);

/** The sequence of the newest state that is drawn. */
export const drawnSequence = signal(0n);
/** Grows with each picture of the scene, in the task that has drawn it. */
export const drawnPictures = signal(0);
/** Grows for each picture that is asked for though nothing has changed. */
export const redraws = signal(0);

/** Pixels of a side, at most. */
export const MAX_SIDE = 8192;

/** A PNG of what the scene shows, without the page around it. Rejects if the browser cannot make it. */
export function takePicture(width: number, height: number): Promise<Blob> {
  return new Promise((resolve, reject) => {
    const fits = (side: number): boolean => Number.isInteger(side) && side >= 1 && side <= MAX_SIDE;
    if (!fits(width) || !fits(height)) {
      reject(new Error(`A picture is from 1 to ${MAX_SIDE} pixels wide and high, not ${width} by ${height}.`));
      return;
    }
    let answered = false;
    const taken = (picture: Promise<Blob>): void => {
      answered = true;
      resolve(picture);
    };
    pictureRequest.value = { width, height, taken };
    pictureRequest.value = null;
    if (!answered) reject(new Error("Nothing is drawn, of which there could be a picture."));
  });
}
