// The load report of a robot, with its findings.
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { reports, type Finding } from "../state/report";
import { Sheet } from "./Sheet";

const shown = signal("");

/** Opens the load report of a robot that this tab loaded. */
export function openReport(robot: string): void {
  shown.value = robot;
}

const RANK = { error: 0, warning: 1, info: 2 } as const;

/** Rendered only while a report is open. */
export function ReportSheet(): JSX.Element | null {
  const report = reports.value.get(shown.value);
  if (!report) return null;
  const findings = report.findings.toSorted((a, b) => RANK[a.severity] - RANK[b.severity] || a.line - b.line);
  return (
    <Sheet
      title={`Load report of ${report.robot}`}
      testId="report-sheet"
      onClose={() => {
        shown.value = "";
      }}
    >
      <p>{report.summary}</p>
      {findings.length === 0 ? (
        <p class="hint">No findings.</p>
      ) : (
        <ul class="findings">
          {findings.map((finding, index) => (
            <FindingItem key={index} finding={finding} />
          ))}
        </ul>
      )}
    </Sheet>
  );
}

function FindingItem({ finding: { severity, disposition, element, line, message, file } }: { finding: Finding }): JSX.Element {
  return (
    <li class={`finding ${severity}`}>
      <span class="severity">{severity}</span>
      <div>
        <p class="where">
          {line > 0 && <span>line {line}</span>} <span>{element}</span> {file !== "" && <span class="file">{file}</span>}
          <span class="disposition">{disposition}</span>
        </p>
        <p>{message}</p>
      </div>
    </li>
  );
}
