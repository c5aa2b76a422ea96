//! The block alone, a PLC cycle for every 20 octets: any inputs, any images.

use film_feed::block::{FilmFeedBlock, Inputs, Periphery};

use super::input::Input;

const PZD: u16 = 0x0118;

#[derive(Default)]
struct Images {
    process_in: [u8; 8],
    parameter_in: [u8; 8],
    control: u16,
    request: Option<[u8; 8]>,
}

impl Periphery for Images {
    fn dprd_dat(&mut self, address: u16, record: &mut [u8; 8]) -> bool {
        *record = if address == PZD {
            self.process_in
        } else {
            self.parameter_in
        };
        true
    }

    fn dpwr_dat(&mut self, address: u16, record: &[u8; 8]) -> bool {
        if address == PZD {
            self.control = u16::from_be_bytes([record[0], record[1]]);
            assert_eq!(record[2..], [0; 6], "words 2 to 4 are never assigned");
        } else {
            self.request = Some(*record);
        }
        true
    }
}

/// Film-feed specification, section 8 and 8.1: what holds in every cycle, whatever the inputs.
pub(crate) fn run(data: &[u8]) {
    let mut input = Input::new(data);
    let mut block = FilmFeedBlock::new();
    let mut images = Images::default();
    while !input.is_empty() {
        let bits = input.octet();
        let bit = |number: u8| bits & 1 << number != 0;
        let mut word = || i16::from_be_bytes([input.octet(), input.octet()]);
        let mut inputs = Inputs {
            pzd_adr: PZD,
            read_mark: bit(0),
            manual: bit(1),
            manual_pos: bit(2),
            manual_neg: bit(3),
            pos_start: bit(4),
            pos_stop: bit(5),
            error_reset: bit(6),
            enable: bit(7),
            velocity: word(),
            mark_velocity: word(),
            acceleration: word(),
            distance: word(),
        };
        let mut image = || std::array::from_fn(|_| input.octet());
        (images.process_in, images.parameter_in) = (image(), image());
        images.request = None;
        let outputs = *block.cycle(&mut inputs, &mut images);

        // Point 1 and step 10: the ranges, in place.
        assert!((1000..=10_000).contains(&inputs.velocity));
        assert!((1000..=inputs.velocity).contains(&inputs.mark_velocity));
        assert!((1000..=10_000).contains(&inputs.acceleration));
        assert!((2000..=20_000).contains(&inputs.distance));
        // Point 12: −200 … +199.99 %.
        assert!(
            (-200.0..200.0).contains(&outputs.speed_percent),
            "{}",
            outputs.speed_percent
        );

        let control = |number: u8| images.control & 1 << number != 0;
        // Steps 5 to 8: each bit from its input, and no start with an error; stop is bit 6 low and bit 11 high together.
        assert_eq!(control(15), inputs.read_mark);
        assert_eq!(
            (control(12), control(14), control(13)),
            (inputs.manual, inputs.manual_pos, inputs.manual_neg)
        );
        assert_eq!(control(5), !inputs.pos_start && !outputs.error);
        assert_eq!(control(6), !inputs.pos_stop);
        assert!(!inputs.pos_stop || control(11));
        assert!(!control(7) || (inputs.error_reset && control(11)));
        assert_eq!(control(3), inputs.enable);
        assert!(control(1) && control(2) && control(4));

        // Point 6: the parameter image is exchanged once a cycle, and not at all under Error_RESET.
        assert_eq!(images.request.is_some(), !inputs.error_reset);
        // Point 17: 1-safe by structure.
        let marking = block.marking();
        let tokens = |places: &[u8]| places.iter().filter(|place| marking.holds(**place)).count();
        assert_eq!(tokens(&[10, 11]), 1);
        assert_eq!(tokens(&[1, 2, 3, 4, 6, 8, 9]), 1);
        assert_eq!(tokens(&[1, 2, 3, 5, 7, 8, 9]) + tokens(&[4]), 1);
        assert!(block.telegram_counter() <= 6);
        let pointer = block.telegram_pointer();
        assert!(pointer == 0 || (22..=70).contains(&pointer) && (pointer - 22).is_multiple_of(8));
    }
}
