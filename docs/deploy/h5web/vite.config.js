// The page and the database are of one origin for the browser: it may send the token, and no other page can.
const proxy = { '^/[^/]+/h5grove/': process.env.GUDGEON_DB ?? 'http://127.0.0.1:8765' };
export default { server: { proxy }, preview: { proxy } };
