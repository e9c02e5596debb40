"""The dashboard in a browser, and pages and pictures that programs write."""
