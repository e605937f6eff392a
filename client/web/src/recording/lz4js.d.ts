// The part of the package that tests use.
declare module "lz4js" {
  export function compress(data: Uint8Array): Uint8Array | number[];
}
