// Parts of the page whose code is loaded when they are first rendered, so that the first view does not wait for it.
import { signal } from "@preact/signals";
import type { FunctionComponent, JSX } from "preact";
import { useEffect } from "preact/hooks";
import { toast } from "../state/toasts";

/**
 * Returns a part that renders nothing until its code is loaded. If the daemon does not serve the code, a message names the part by `what`, with
 * an article, and `close` is called.
 */
export function lazy<P extends object>(load: () => Promise<FunctionComponent<P>>, what: string, close: () => void = () => undefined): (properties: P) => JSX.Element | null {
  const loaded = signal<{ Part: FunctionComponent<P> } | null>(null);
  return function Lazy(properties: P): JSX.Element | null {
    useEffect(() => {
      if (loaded.peek()) return;
      load().then(
        (Part) => (loaded.value = { Part }),
        () => {
          close();
          toast("error", `${what} could not be loaded from the daemon; open it again once it answers.`);
        },
      );
    }, []);
    const Part = loaded.value?.Part;
    return Part ? <Part {...properties} /> : null;
  };
}
