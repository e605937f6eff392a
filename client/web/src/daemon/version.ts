// The version of the schema that this page was built with.

/** The form of the header `simd-api-version`. */
export const API_VERSION = "1.0";
