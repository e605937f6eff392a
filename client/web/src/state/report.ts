// What became of the robots that this tab loaded, and how far the one that is being loaded is.
import { signal } from "@preact/signals";

/** What was done to one element of a description. */
export interface Finding {
  severity: "info" | "warning" | "error";
  disposition: "used" | "defaulted" | "repaired" | "ignored" | "refused";
  /** Where, for instance `joint "elbow" limit`. */
  element: string;
  /** In the URDF, from 1; 0 where it does not apply. */
  line: number;
  /** A sentence. */
  message: string;
  /** The mesh that it is about; empty for the URDF itself. */
  file: string;
}

/** What was done to a description on its way into the world. */
export interface LoadReport {
  robot: string;
  /** One line. */
  summary: string;
  findings: Finding[];
}

/** What is being loaded. */
export interface Loading {
  /** The file, or the robot once its name is known. */
  what: string;
  /** For people: "uploading", "reading meshes". */
  phase: string;
  /** Of `total`, files or bytes; 0 of 0 where nobody can say. */
  done: number;
  total: number;
  /** The file that it is at; may be empty. */
  item: string;
}

/** By the robot's name. */
export const reports = signal<Map<string, LoadReport>>(new Map());
export const loading = signal<Loading | null>(null);
/** Robots that this tab loaded and whose lowest point nobody has measured yet: they may be sunk in the ground. */
export const unmeasured = signal<ReadonlySet<string>>(new Set());
