"use strict";
// Stands in until the page is built.
document.getElementById("app").textContent = document.title;
