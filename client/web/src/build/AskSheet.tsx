// A question before changes that concern other clients too. It names them.
import type { JSX } from "preact";
import { Sheet } from "../panels/Sheet";
import { othersHere, tool } from "../state/tools";

interface Properties {
  title: string;
  text: string;
  button: string;
  run: () => void;
}

export function AskSheet({ title, text, button, run }: Properties): JSX.Element {
  const close = (): void => {
    tool.value = null;
  };
  const others = othersHere();
  return (
    <Sheet title={title} testId="ask-sheet" onClose={close}>
      <div class="ask">
        <p>{text}</p>
        {others.length > 0 && (
          <p>
            Also here: <b data-testid="ask-others">{others.join(", ")}</b>.
          </p>
        )}
        <div class="build-buttons">
          <button
            type="button"
            class="button danger"
            data-testid="ask-surely"
            autofocus
            onClick={() => {
              close();
              run();
            }}
          >
            {button}
          </button>
          <button type="button" class="button" data-testid="ask-not" onClick={close}>
            Leave it
          </button>
        </div>
      </div>
    </Sheet>
  );
}
