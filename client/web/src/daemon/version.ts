// The version of the schema that this page was built with.

/** As the header `simd-api-version` says it. */
export const API_VERSION = "1.0";
