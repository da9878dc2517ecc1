"""The modal database over HTTP: records, parts of their arrays, and a page that shows them."""
