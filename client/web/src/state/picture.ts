// Pictures of the scene that the user requests.
import { signal } from "@preact/signals";

/** A requested picture. */
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

/** The sequence of the newest drawn state. */
export const drawnSequence = signal(0n);
/** Increases with each picture of the scene, in the task that has drawn it. */
export const drawnPictures = signal(0);
/** Median of milliseconds from one of the newest pictures to the next, while they follow one another; 0 before that is known. */
export const pictureInterval = signal(0);
/** Increases with each picture that is requested without a change. */
export const redraws = signal(0);

/** Maximum pixels of a side. */
export const MAX_SIDE = 8192;

/** Returns a PNG of the scene, without the page around it. Rejects if the browser cannot make it. */
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
    if (!answered) reject(new Error("There is no picture to save: nothing is drawn."));
  });
}
