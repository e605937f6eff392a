// Load reports of the robots that this tab loaded, and the progress of the current load.
import { signal } from "@preact/signals";

/** Treatment of one element of a description. */
export interface Finding {
  severity: "info" | "warning" | "error";
  disposition: "used" | "defaulted" | "repaired" | "ignored" | "refused";
  /** Element of the description, for instance `joint "elbow" limit`. */
  element: string;
  /** Line in the URDF, from 1; 0 if it does not apply. */
  line: number;
  /** A sentence. */
  message: string;
  /** Mesh of the finding; empty for the URDF. */
  file: string;
}

/** Treatment of a description while it is loaded. */
export interface LoadReport {
  robot: string;
  /** One line. */
  summary: string;
  findings: Finding[];
}

/** Progress of the current load. */
export interface Loading {
  /** The file, or the robot once its name is known. */
  what: string;
  /** For the user: "uploading", "reading meshes". */
  phase: string;
  /** Part of `total`, files or bytes; both are 0 if unknown. */
  done: number;
  total: number;
  /** The current file; may be empty. */
  item: string;
}

/** By the robot's name. */
export const reports = signal<Map<string, LoadReport>>(new Map());
export const loading = signal<Loading | null>(null);
