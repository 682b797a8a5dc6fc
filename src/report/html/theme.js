"use strict";
// Before the page is drawn, so that a dark page never shows white.
document.documentElement.dataset.theme = window.matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
