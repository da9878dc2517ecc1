import '@h5web/app/styles.css';
import React from 'react';
import { createRoot } from 'react-dom/client';
import { App, H5GroveProvider, createBasicFetcher } from '@h5web/app';

const asked = new URLSearchParams(location.search); // ?db=default&key=KEY
const url = `${location.origin}/${asked.get('db') ?? 'default'}/h5grove`;
const token = (sessionStorage.token ??= prompt('Token of the database') ?? '');
const headers = { Authorization: `Bearer ${token}` };
const filepath = `${asked.get('key')}.h5`;

// NPY and TIFF are made by the server, which asks for the token there, too.
const getExportURL = (format, dataset, selection) =>
  ['npy', 'tiff'].includes(format)
    ? async () => {
        const query = new URLSearchParams({ file: filepath, path: dataset.path, format, ...(selection && { selection }) });
        const answer = await fetch(`${url}/data?${query}`, { headers });
        if (!answer.ok) throw new Error((await answer.json()).message);
        return answer.blob();
      }
    : undefined;

createRoot(document.getElementById('root')).render(
  <div style={{ height: '100vh' }}>
    <H5GroveProvider url={url} filepath={filepath} fetcher={createBasicFetcher({ headers })} getExportURL={getExportURL}>
      <App />
    </H5GroveProvider>
  </div>,
);
