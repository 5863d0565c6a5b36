"""Tables: their content, and their output as Markdown, LaTeX and HTML."""
