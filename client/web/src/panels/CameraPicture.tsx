// Pictures of a robot's camera, while the panel is open.
import type { JSX } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { followPicture } from "../daemon/pictures";
import { keepPicture } from "../state/pictures";

/** The camera's picture, or the reason for its absence. */
export function CameraPicture({ robot, sensor }: { robot: string; sensor: string }): JSX.Element {
  const canvas = useRef<HTMLCanvasElement>(null);
  const [said, setSaid] = useState("no picture yet");
  useEffect(() => {
    const end = followPicture(robot, sensor, (picture, problem) => {
      setSaid(picture ? `at ${picture.time.toFixed(3)} s` : problem);
      // An old picture is not shown with a world that has moved since.
      keepPicture(sensor, picture);
      const element = canvas.current;
      if (!element || !picture) return;
      element.width = picture.width;
      element.height = picture.height;
      element.getContext("2d")?.putImageData(new ImageData(picture.pixels, picture.width, picture.height), 0, 0);
    });
    return () => {
      end();
      keepPicture(sensor, undefined);
    };
  }, [robot, sensor]);
  return (
    <figure class="camera-picture" data-testid={`picture-${sensor}`}>
      <canvas ref={canvas} width={0} height={0} role="img" aria-label={`What camera ${sensor} sees`} />
      <figcaption class="hint">{said}</figcaption>
    </figure>
  );
}
