/* Pictures of a frame's stages, painted from the frame's planes. */
#ifndef PSR_CLIENT_OUTPUT_SHOW_H
#define PSR_CLIENT_OUTPUT_SHOW_H

#include <stdint.h>
#include "client/lib/picture.h"
#include "psr/client.h"

struct show;

const char *show_name(unsigned i); /* of stage i, from 0; NULL: there are no more */
const struct show *show_find(const char *name, struct psr_error *err); /* NULL: no such stage (ARG) */
uint32_t show_planes(const struct show *show); /* planes that it needs: bits of enum psr_plane */

/* Paints a frame with those planes into rgb, 3 bytes a pixel. MEMORY. */
int show_paint(const struct show *show, const struct psr_frame *picture, const struct psr_msg_frame_begin *begin,
               const struct psr_msg_frame_end *end, uint8_t *rgb);

/* Paints the frame of an event, and writes it as a colour picture. */
int show_write(const struct show *show, const struct psr_event *event, const char *path, struct psr_error *err);

#define SHOW_HELP \
	"What --show paints; in the first five, pixels that the fill gave their colour look like the nearest\n" \
	"sample, but darker:\n" \
	"  blocks   a random colour for each block that is seen\n" \
	"  samples  a random colour for each sample\n" \
	"  cull     how blocks passed the cull: green, their cones face the eye; orange, some of their samples may\n" \
	"           not; violet, two-sided; shades tell blocks apart\n" \
	"  levels   levels of the model: red is the finest, then orange, yellow, green, cyan, blue, violet, pink;\n" \
	"           the paler, the coarser the depth buffer that the block needs\n" \
	"  normals  x, y, z in world space as red, green, blue\n" \
	"  weights  white is 1; weight 0 is yellow where something nearer covers a sample, red where there is none;\n" \
	"           blue: no sample, covered in part\n" \
	"  holes    the picture in dim grey, weight 0 as in weights\n" \
	"  depth    near is white, far is dark\n"

#endif
