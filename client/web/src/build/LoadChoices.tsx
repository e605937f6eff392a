// Choice of the descriptions that were found among dropped files.
import type { JSX } from "preact";
import { useState } from "preact/hooks";
import { shownPath, type Description } from "../load/descriptions";

/** Number of rows that are shown; a filter finds the others. */
const MOST_ROWS = 200;

interface Properties {
  found: readonly Description[];
  /** Paths. */
  chosen: ReadonlySet<string>;
  onChange: (chosen: ReadonlySet<string>) => void;
}

/** A list with a box for each: name, kind and how many links it has. */
export function LoadChoices({ found, chosen, onChange }: Properties): JSX.Element {
  const [filter, setFilter] = useState("");
  const paths = found.map(({ path }) => path);
  const wanted = filter.toLowerCase();
  const rows = found.filter(({ path }) => path.toLowerCase().includes(wanted));
  return (
    <fieldset class="load-choices">
      <legend>
        {chosen.size === 0 ? "None" : chosen.size} of {found.length} descriptions {chosen.size > 1 ? "are" : "is"} chosen
      </legend>
      {found.length > 10 && (
        <input
          type="search"
          class="filter"
          data-testid="load-filter"
          placeholder="Filter"
          aria-label="Filter descriptions"
          value={filter}
          onInput={(event) => setFilter(event.currentTarget.value)}
          onKeyDown={(event) => {
            // Enter filters, and loads nothing.
            if (event.key === "Enter") event.preventDefault();
          }}
        />
      )}
      <ul tabIndex={0} aria-label="Descriptions">
        {rows.slice(0, MOST_ROWS).map(({ path, kind, links }) => (
          <li key={path}>
            <label title={path} data-testid="load-choice">
              <input
                type="checkbox"
                checked={chosen.has(path)}
                onChange={(event) => {
                  const next = new Set(chosen);
                  if (event.currentTarget.checked) next.add(path);
                  else next.delete(path);
                  onChange(next);
                }}
              />
              <span class="name">
                <bdi>{shownPath(path, paths)}</bdi>
              </span>
              <span class="hint">{kind}</span>
              <span class="hint tabular">{links === undefined ? "" : `${links} ${links === 1 ? "link" : "links"}`}</span>
            </label>
          </li>
        ))}
      </ul>
      {rows.length > MOST_ROWS && <p class="hint">and {rows.length - MOST_ROWS} more: the filter finds them</p>}
    </fieldset>
  );
}
