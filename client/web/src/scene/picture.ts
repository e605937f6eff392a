// Draws the scene once at another size, as a file.
import { Vector2, type WebGLRenderer } from "three";
import type { ViewCamera } from "./view-camera";

/**
 * Returns a PNG of this many pixels, drawn by `draw`. The caller draws again, since the canvas is left empty. Throws if the graphics processor
 * has no memory for a picture of that size.
 */
export function pictureOf(renderer: WebGLRenderer, draw: () => void, camera: ViewCamera, width: number, height: number): Promise<Blob> {
  const { domElement: canvas } = renderer;
  const [ratio, size, aspect] = [renderer.getPixelRatio(), renderer.getSize(new Vector2()), camera.aspect];
  try {
    renderer.setPixelRatio(1);
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    draw();
    const context = renderer.getContext();
    if (context.drawingBufferWidth !== width || context.drawingBufferHeight !== height) {
      throw new Error(`This browser draws at most ${context.drawingBufferWidth} by ${context.drawingBufferHeight} pixels of this picture; choose a smaller one.`);
    }
    // Reads the canvas now, but calls back later.
    return new Promise((resolve, reject) => {
      canvas.toBlob((blob) => {
        if (blob) resolve(blob);
        else reject(new Error("The browser could not make a PNG of the picture; choose a smaller one."));
      }, "image/png");
    });
  } finally {
    renderer.setPixelRatio(ratio);
    renderer.setSize(size.x, size.y, false);
    camera.aspect = aspect;
    camera.updateProjectionMatrix();
  }
}
