import 'ol/ol.css';
import 'uplot/dist/uPlot.min.css';
import './style.css';
import { mount } from 'svelte';
import { folder, list } from './api/source';

document.querySelector('.as-file')?.remove();
// What draws maps is large, and a list of surveys needs none of it.
const page = list && !folder ? import('./Fleet.svelte') : import('./App.svelte');
void page.then(({ default: Page }) => mount(Page, { target: document.getElementById('studio')! }));
