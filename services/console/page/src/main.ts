// SPDX-License-Identifier: Apache-2.0
import 'uplot/dist/uPlot.min.css';
import './app.css';
import { mount } from 'svelte';
import App from './App.svelte';
import { applyTheme, storedTheme } from './theme.ts';

applyTheme(storedTheme());
const target = document.getElementById('console');
if (target) mount(App, { target });
