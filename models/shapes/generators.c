#include "generators.h"

#include <stdio.h>
#include <string.h>

const struct generator generators[] = {
	{ "chair", "a Windsor chair: turned legs, slender spindles, wood grain", make_chair },
	{ "dragon", "a dragon wound into a knot: scales, spikes, whiskers", make_dragon },
	{ "gavel", "a gavel on its block: turned wood, brass bands", make_gavel },
	{ "kittyhawk", "the Wright Flyer of 1903: muslin, struts and wires", make_kittyhawk },
	{ "pencil", "a sharpened hexagonal pencil: edges, scallops, a fine point", make_pencil },
	{ "pinetree", "a pine: every needle of its twigs, by instances", make_pinetree },
	{ "plant", "a plant in a pot: thin two-sided leaves with veins, blossoms", make_plant },
	{ "sailboat", "a sloop: hull, planked deck, sails, stays and shrouds", make_sailboat },
	{ "table", "a table: checkered cloth, planks, a bowl of fruit", make_table },
	{ "teapot", "Newell's teapot: 32 bicubic Bezier patches, glazed", make_teapot },
	{ "top", "a spinning top: large smooth surfaces, lacquered bands", make_top },
	{ "toybird", "a wooden bird on wheels with its string", make_toybird },
	{ "tree", "a tree of 26,438 cones and ellipsoids, by instances", make_tree },
	{ "wheel", "a bicycle wheel: 36 thin spokes, tire, rim, hub", make_wheel },
};
const size_t n_generators = sizeof generators / sizeof generators[0];

const struct generator *generator_find(const char *name, struct psr_error *err)
{
	char names[256] = "";
	size_t used = 0;

	for (size_t i = 0; i < n_generators; i++) {
		if (strcmp(generators[i].name, name) == 0)
			return &generators[i];
	}
	for (size_t i = 0; i < n_generators && used < sizeof names; i++)
		used += (size_t)snprintf(names + used, sizeof names - used, "%s%s", i == 0 ? "" : ", ", generators[i].name);
	psr_fail(err, PSR_ERR_ARG, "there is no generator '%.64s'; there are: %s", name, names);
	return NULL;
}
