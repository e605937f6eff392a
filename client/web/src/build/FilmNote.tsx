// Note that a video is being taken, with the button that ends it. The video shows only the picture, without
// this note.
import type { JSX } from "preact";
import { Icon } from "../panels/icons";
import { film } from "../state/film";

export function FilmNote(): JSX.Element {
  return (
    <div class="film-note" data-testid="film-note">
      <span role="status">
        <Icon name="record" /> A video is being taken
      </span>
      <button type="button" class="button" data-testid="film-end" title="End the video, and save it on this machine" onClick={() => film.peek()?.end()}>
        End it
      </button>
    </div>
  );
}
