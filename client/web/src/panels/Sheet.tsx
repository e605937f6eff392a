// A modal dialog: the browser keeps the focus in it, and Escape closes it.
import type { ComponentChildren, JSX } from "preact";
import { useLayoutEffect, useRef } from "preact/hooks";
import { Icon } from "./icons";

interface Properties {
  title: string;
  testId: string;
  onClose: () => void;
  children: ComponentChildren;
}

/** Open as long as it is rendered. */
export function Sheet({ title, testId, onClose, children }: Properties): JSX.Element {
  const dialog = useRef<HTMLDialogElement>(null);
  // Runs before it is painted: it takes the focus, which a quick user may already have moved into one of its
  // fields.
  useLayoutEffect(() => {
    dialog.current?.showModal();
  }, []);
  return (
    <dialog
      ref={dialog}
      class="sheet"
      aria-label={title}
      data-testid={testId}
      onClose={onClose}
      onClick={(event) => {
        // A press on the backdrop has the dialog itself as its target.
        if (event.target === dialog.current) dialog.current?.close();
      }}
    >
      <div class="sheet-frame">
        <header>
          <h2>{title}</h2>
          <button type="button" class="button quiet" aria-label="Close" title="Close (Escape)" onClick={() => dialog.current?.close()}>
            <Icon name="close" />
          </button>
        </header>
        {/* It scrolls by keys too, even if nothing in it has the focus. */}
        <div class="sheet-body" tabIndex={0}>
          {children}
        </div>
      </div>
    </dialog>
  );
}
