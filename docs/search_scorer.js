/* The weights of a search: Sphinx's own, but that decisions and lab notes come after everything else. */
var Scorer = {
  score: ([page, , , , score]) => (/^(decisions|measured\/notes)\//.test(page) ? score - 1000 : score),
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
