// Files that the page makes, for the user to keep.

/** Offers a file to the browser as a download. */
export function save(name: string, file: Blob): void {
  const address = URL.createObjectURL(file);
  const link = document.createElement("a");
  link.href = address;
  link.download = name;
  link.click();
  // Frees the file once the download has started.
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}
